# SPDX-License-Identifier: Apache-2.0
"""Function blocks, with the names of IEC 61131-3 where the standard has them.

A block is called once per scan and returns its output Q. Timers take the present time, so they run in simulated time. A
time that is equal up to rounding has elapsed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

ROUNDING = 1e-9
"""Tolerance against rounding, s: a sum of ticks must not miss the preset time."""


def limit(low: float, value: float, high: float) -> float:
    """Return the value, or the bound that it exceeds (LIMIT)."""
    return min(max(value, low), high)


@dataclass
class TON:
    """On-delay: Q turns on once IN has been on for `pt` s, and off with IN."""

    pt: float
    q: bool = field(default=False, init=False)
    et: float = field(default=0.0, init=False)
    """Time that IN has been on, at most pt, s."""
    _since: float | None = field(default=None, init=False, repr=False)

    def __call__(self, in_: bool, time: float) -> bool:
        """Evaluate one scan at a time in s."""
        if not in_:
            self._since = None
        elif self._since is None:
            self._since = time
        elapsed = 0.0 if self._since is None else time - self._since
        self.q = in_ and elapsed >= self.pt - ROUNDING
        self.et = min(elapsed, self.pt)
        return self.q


@dataclass
class TOF:
    """Off-delay: Q turns on with IN, and off once IN has been off for `pt` s."""

    pt: float
    q: bool = field(default=False, init=False)
    _since: float = field(default=-math.inf, init=False, repr=False)

    def __call__(self, in_: bool, time: float) -> bool:
        """Evaluate one scan at a time in s."""
        if in_:
            self.q, self._since = True, math.inf
        elif self.q:
            self._since = min(self._since, time)
            self.q = time - self._since < self.pt - ROUNDING
        return self.q


@dataclass
class TP:
    """Pulse: Q is on for `pt` s from a rising edge of IN. Further edges during the pulse have no effect."""

    pt: float
    q: bool = field(default=False, init=False)
    _since: float = field(default=-math.inf, init=False, repr=False)
    _before: bool = field(default=False, init=False, repr=False)

    def __call__(self, in_: bool, time: float) -> bool:
        """Evaluate one scan at a time in s."""
        self.q = time - self._since < self.pt - ROUNDING
        if in_ and not self._before and not self.q:
            self.q, self._since = self.pt > 0.0, time
        self._before = in_
        return self.q


@dataclass
class R_TRIG:
    """Rising edge: Q is on for one scan when CLK turns on. CLK counts as off before the first scan."""

    _before: bool = field(default=False, init=False, repr=False)

    def __call__(self, clk: bool) -> bool:
        """Evaluate one scan."""
        q = clk and not self._before
        self._before = clk
        return q


@dataclass
class F_TRIG:
    """Falling edge: Q is on for one scan when CLK turns off. CLK counts as off before the first scan."""

    _before: bool = field(default=False, init=False, repr=False)

    def __call__(self, clk: bool) -> bool:
        """Evaluate one scan."""
        q = self._before and not clk
        self._before = clk
        return q


@dataclass
class SR:
    """Set-dominant flip-flop."""

    q: bool = field(default=False, init=False)

    def __call__(self, s1: bool, r: bool) -> bool:
        """Evaluate one scan: set wins."""
        self.q = s1 or (self.q and not r)
        return self.q


@dataclass
class RS:
    """Reset-dominant flip-flop."""

    q: bool = field(default=False, init=False)

    def __call__(self, s: bool, r1: bool) -> bool:
        """Evaluate one scan: reset wins."""
        self.q = not r1 and (s or self.q)
        return self.q


@dataclass
class CTU:
    """Up-counter of rising edges of CU: Q is on from `pv` edges on, until reset."""

    pv: int
    cv: int = field(default=0, init=False)
    """Edges counted."""
    _edge: R_TRIG = field(default_factory=R_TRIG, init=False, repr=False)

    def __call__(self, cu: bool, r: bool) -> bool:
        """Evaluate one scan: reset wins."""
        edge = self._edge(cu)
        self.cv = 0 if r else self.cv + edge
        return self.cv >= self.pv


@dataclass
class HYSTERESIS:
    """Switch that turns on at `high` and off at `low`, and keeps its state in between."""

    low: float
    high: float
    q: bool = field(default=False, init=False)

    def __call__(self, value: float) -> bool:
        """Evaluate one scan: on wins if low equals high."""
        self.q = value >= self.high or (self.q and value > self.low)
        return self.q


@dataclass
class RAMP:
    """Value that follows a target at `rate` (units/s) or less, from `start`."""

    rate: float
    start: float = 0.0
    out: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self.out = self.start

    def __call__(self, target: float, length: float) -> float:
        """Evaluate one scan of a length in s."""
        step = self.rate * length
        self.out += limit(-step, target - self.out, step)
        return self.out


@dataclass
class COVERED:
    """Photo-eye at which bottles stand: covered once blocked for `on` s, uncovered once free for `off` s.

    Bottles that pass one by one never cover it if each takes less than `on`.
    """

    on: float
    off: float
    q: bool = field(default=False, init=False)
    _blocked: TON = field(init=False, repr=False)
    _free: TON = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._blocked, self._free = TON(self.on), TON(self.off)

    def __call__(self, blocked: bool, time: float) -> bool:
        """Evaluate one scan at a time in s."""
        stands, gone = self._blocked(blocked, time), self._free(not blocked, time)
        self.q = stands or (self.q and not gone)
        return self.q

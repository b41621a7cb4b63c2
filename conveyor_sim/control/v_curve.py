# SPDX-License-Identifier: Apache-2.0
"""V-curve: machines on both sides of the bottleneck run faster, the more so the further away they are.

Plotted along the line, the rates form a V with the bottleneck at its tip. The surplus recovers losses of a stop:
upstream it refills the buffers before the bottleneck, downstream it empties those behind it. While a buffer is at its
level, the machine beyond it follows the one nearer to the bottleneck. After a stop, a buffer is back at its level in
surplus / rate difference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from conveyor_sim.control.level import Level
from conveyor_sim.control.scan import Inputs, require


class _Buffer(Enum):
    SHORT = -1
    AT_LEVEL = 0
    OVER = 1


@dataclass
class Neighbour:
    """Machine beside the bottleneck, and the buffer between it and the next machine towards the bottleneck.

    command: sets its rate (machines/<m>/rate, 1/s). level: of the buffer, in bottles or in covered back-up eyes;
    machines must not share one. From `high` up there is a surplus, from `low` down a lack, each until the level is back
    at `target`. With two back-up eyes these levels are 0, 1 and 2.
    """

    command: str
    level: Level
    low: float
    target: float
    high: float
    _buffer: _Buffer = field(default=_Buffer.AT_LEVEL, init=False, repr=False)

    def __post_init__(self) -> None:
        levels = f"{self.low:g}, {self.target:g} and {self.high:g}"
        require(self.low <= self.target <= self.high, f"low, target, high: {levels} given, expected a rising order")

    def buffer(self, inputs: Inputs) -> _Buffer:
        """Return the state of the buffer. Call it once per scan."""
        level = self.level.read(inputs)
        if self._buffer is _Buffer.OVER and level > self.target:
            return self._buffer
        if self._buffer is _Buffer.SHORT and level < self.target:
            return self._buffer
        self._buffer = _Buffer.AT_LEVEL
        if level > self.target and level >= self.high:
            self._buffer = _Buffer.OVER
        elif level < self.target and level <= self.low:
            self._buffer = _Buffer.SHORT
        return self._buffer


@dataclass
class VCurve:
    """Rates of a line with a bottleneck.

    bottleneck: the command that sets its rate; None: another controller gives it. rate: 1/s, or the signal that holds
    it in bottles per hour, as a panel does. margin: share of `rate` per step away from the bottleneck, by which a
    machine may be faster or must be slower; its limit must allow that. upstream, downstream: the machines on either
    side, the nearest first.
    """

    bottleneck: str | None
    rate: float | str
    margin: float
    upstream: tuple[Neighbour, ...] = ()
    downstream: tuple[Neighbour, ...] = ()

    def __post_init__(self) -> None:
        furthest = max(len(self.upstream), len(self.downstream), 1)
        fits = 0.0 < self.margin < 1.0 / furthest
        require(fits, f"margin: {self.margin:g} given, expected more than 0 and less than {1.0 / furthest:g}")

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return a rate for each machine, 1/s."""
        commanded = inputs[self.rate] / 3600.0 if isinstance(self.rate, str) else self.rate
        answer = {} if self.bottleneck is None else {self.bottleneck: commanded}
        # Upstream a lack requires a higher rate, downstream a surplus.
        for machines, faster in ((self.upstream, _Buffer.SHORT), (self.downstream, _Buffer.OVER)):
            rate = commanded
            for step, machine in enumerate(machines, 1):
                buffer = machine.buffer(inputs)
                if buffer is not _Buffer.AT_LEVEL:
                    rate = commanded * (1.0 + (step if buffer is faster else -step) * self.margin)
                answer[machine.command] = rate
        return answer

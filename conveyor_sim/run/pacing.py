# SPDX-License-Identifier: Apache-2.0
"""Simulated time against wall time: when the next tick is due, and how often messages may be sent.

Callers pass wall times, as seconds of any steady clock.
"""

from __future__ import annotations

MAX_LAG = 0.1
"""Lag up to which missed ticks are caught up at full speed, s of wall time. More is dropped."""


class Pacer:
    """Keeps simulated time no faster than `factor` times wall time, and counts the ticks that came late.

    A tick is an overrun if it ended after the next one was due. Lag up to MAX_LAG is caught up. More lag is dropped,
    and added to `lost`.
    """

    def __init__(self, factor: float, tick: float) -> None:
        """factor: simulated seconds per wall second, 0 for as fast as possible. tick: length of a tick, s."""
        self.tick = tick
        self.overruns = 0
        self.lost = 0.0
        """Dropped lag, s of wall time."""
        self._factor = factor
        self._due: float | None = None

    @property
    def factor(self) -> float:
        """Simulated seconds per wall second; 0 for as fast as possible."""
        return self._factor

    @factor.setter
    def factor(self, factor: float) -> None:
        self._factor = factor
        self._due = None

    def restart(self) -> None:
        """Forget the lag: the next tick is due at the next call of `wait`."""
        self._due = None

    def catch_breath(self, now: float) -> None:
        """Exclude the time spent waiting for the stepping client from the lag."""
        if self._due is not None and self._due < now:
            self._due = now

    def wait(self, now: float) -> float:
        """Return the seconds until the next tick may start."""
        if self._factor == 0.0:
            return 0.0
        if self._due is None:
            self._due = now
        return max(0.0, self._due - now)

    def ticked(self, now: float) -> None:
        """Count a tick that has just ended."""
        if self._factor == 0.0 or self._due is None:
            return
        self._due += self.tick / self._factor
        if now > self._due:
            self.overruns += 1
        if now > self._due + MAX_LAG:
            self.lost += now - self._due
            self._due = now


class RateCap:
    """Limits messages to `rate` per wall second on average; 0 for no limit."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate if rate > 0.0 else 0.0
        self._due = 0.0

    def ready(self, now: float) -> bool:
        """Return True if a message may be sent now.

        Messages may be up to half a period early, so that jitter drops none.
        """
        return now >= self._due - 0.5 * self._period

    def sent(self, now: float) -> None:
        """Count a message sent now."""
        self._due = max(self._due + self._period, now)

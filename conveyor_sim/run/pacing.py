"""Simulated time against wall time: when the next tick is due, and how often something may be sent.

Wall times are passed in, as seconds of any steady clock, so these rules need no clock of their own.
"""

from __future__ import annotations

# Beyond this lag the ticks missed are given up rather than caught up at full speed.
MAX_LAG = 0.1  # s of wall time


class Pacer:
    """Keeps simulated time no faster than `factor` times wall time, and counts the ticks that came late.

    A tick is an overrun if it ended after the next one was due. Lag up to MAX_LAG is caught up; what is beyond is
    given up and added to `lost`.
    """

    def __init__(self, factor: float, tick: float) -> None:
        """`factor`: simulated seconds per wall second, 0 for as fast as possible. `tick`: s."""
        self.tick = tick
        self.overruns = 0
        self.lost = 0.0  # s of wall time given up
        self._factor = factor
        self._due: float | None = None

    @property
    def factor(self) -> float:
        return self._factor

    @factor.setter
    def factor(self, factor: float) -> None:
        self._factor = factor
        self._due = None

    def restart(self) -> None:
        """Forget the past: the next tick is due when it is asked for."""
        self._due = None

    def catch_breath(self, now: float) -> None:
        """Whoever drives the ticks was waited for: that is no lag of ours."""
        if self._due is not None and self._due < now:
            self._due = now

    def wait(self, now: float) -> float:
        """Seconds until the next tick may start; 0 if at once."""
        if self._factor == 0.0:
            return 0.0
        if self._due is None:
            self._due = now
        return max(0.0, self._due - now)

    def ticked(self, now: float) -> None:
        """One tick has just ended."""
        if self._factor == 0.0 or self._due is None:
            return
        self._due += self.tick / self._factor
        if now > self._due:
            self.overruns += 1
        if now > self._due + MAX_LAG:
            self.lost += now - self._due
            self._due = now


class RateCap:
    """Says yes at most `rate` times a wall second in the mean, and always if `rate` is 0."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate if rate > 0.0 else 0.0
        self._due = 0.0

    def ready(self, now: float) -> bool:
        """Whether something may be sent now; half a period early counts as in time, so jitter thins nothing."""
        return now >= self._due - 0.5 * self._period

    def sent(self, now: float) -> None:
        self._due = max(self._due + self._period, now)

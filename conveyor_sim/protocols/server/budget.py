"""`Budget`: work units or requests that a client may use, refilled at a constant rate (token bucket)."""

from __future__ import annotations

import time
from collections.abc import Callable


class Budget:
    """Units of one client, or of a group of clients."""

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Start full. rate: units per second. burst: units that may be used at once. clock: returns seconds."""
        self._rate, self._burst, self._clock = rate, burst, clock
        self._level, self._at = burst, clock()

    def spend(self, units: float) -> bool:
        """Spend units; the balance may become negative. Return True if it did not."""
        now = self._clock()
        self._level = min(self._burst, self._level + self._rate * (now - self._at)) - units
        self._at = now
        return self._level >= 0.0

    def delay(self) -> float:
        """Return the seconds until the balance is no longer negative."""
        self.spend(0.0)
        return max(0.0, -self._level / self._rate)

    def restore(self, share: float) -> None:
        """Raise the level to a share of the burst, 0 to 1, if it is lower."""
        self._level = max(self._level, share * self._burst)

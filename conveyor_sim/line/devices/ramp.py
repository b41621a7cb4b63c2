"""Ramps: a value that follows its setpoint within limits of acceleration and jerk."""

import math
from dataclasses import dataclass


@dataclass
class Ramp:
    """A speed on its way: no overshoot from rest, and what jerk allows where the setpoint changes on the way."""

    value: float
    """m/s"""
    acceleration: float = 0.0
    """m/s^2, in the last interval."""

    def approach(self, setpoint: float, limit: float, jerk: float | None, interval: float) -> float:
        """The speed (m/s) after an interval (s); limit: m/s^2, jerk: m/s^3 or None for no limit."""
        left = setpoint - self.value
        if left == 0.0 and self.acceleration == 0.0:
            return self.value
        wanted = min(limit, abs(left) / interval)
        if jerk is not None:
            # The sum of a, a - j dt, ... down to 0, each for dt, is a^2 / (2 j) + a dt / 2.
            wanted = min(wanted, jerk * (math.sqrt(0.25 * interval**2 + 2.0 * abs(left) / jerk) - 0.5 * interval))
        wanted = math.copysign(wanted, left)
        if jerk is not None:
            most = jerk * interval
            wanted = min(max(wanted, self.acceleration - most), self.acceleration + most)
        change = wanted * interval
        arrived = abs(left - change) <= 1e-12 * max(1.0, abs(setpoint))
        self.acceleration = wanted
        self.value = setpoint if arrived else self.value + change
        if arrived and (jerk is None or abs(wanted) <= jerk * interval):
            self.acceleration = 0.0
        return self.value

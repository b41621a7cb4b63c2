# SPDX-License-Identifier: Apache-2.0
"""Failures of a machine, drawn from the seed, and its planned stops."""

import math

import numpy as np

from conveyor_sim.scene.failures import Exponential, Failure, FixedTimes, PlannedStop, Times, Weibull

LONGEST = 2**52
"""Longest time in ticks. A checkpoint holds no larger number exactly."""


class Draws:
    """Successive times from a distribution. Public attributes are stored in checkpoints."""

    def __init__(self, times: Times, random: np.random.Generator, tick: float) -> None:
        """Start before the first time.

        random: a separate stream. tick: s.
        """
        self._times, self._tick = times, tick
        self.random = random
        self.count = 0
        """Number of times drawn."""

    def ticks(self) -> int:
        """Draw the next time, in ticks: rounded to the nearest, at least 1."""
        times, number = self._times, self.count
        self.count += 1
        if isinstance(times, FixedTimes):
            time = times.times[number % len(times.times)]
        elif isinstance(times, Exponential):
            time = times.mean * float(self.random.standard_exponential())
        else:
            time = weibull_scale(times) * float(self.random.weibull(times.shape))
        return max(1, min(round(time / self._tick), LONGEST))


def weibull_scale(times: Weibull) -> float:
    """Return the scale parameter (s) of a Weibull distribution with a mean and a shape: mean / Gamma(1 + 1/shape)."""
    return times.mean / math.gamma(1.0 + 1.0 / times.shape)


class FailureClock:
    """Failure mode of a machine. Public attributes are stored in checkpoints."""

    def __init__(self, failure: Failure, between: Draws, repair: Draws) -> None:
        self._running = failure.counted == "running"
        self.between, self.repair = between, repair
        self.failed = False
        self.left = between.ticks()
        """Ticks until the machine fails or is repaired."""

    def advance(self, running: bool) -> bool:
        """Advance by one tick. Return True if the machine failed or was repaired.

        running: True if the machine ran in the tick.
        """
        if not running and self._running and not self.failed:
            return False
        self.left -= 1
        if self.left > 0:
            return False
        self.failed = not self.failed
        self.left = (self.repair if self.failed else self.between).ticks()
        return True


class PlannedTimes:
    """Times of a planned stop."""

    def __init__(self, stop: PlannedStop, tick: float) -> None:
        """Convert the times to ticks.

        tick: s.
        """
        self._start, self._duration = round(stop.start / tick), max(1, round(stop.duration / tick))
        self._every = None if stop.every is None else max(1, round(stop.every / tick))

    def on(self, tick: int) -> bool:
        """Return True if the stop is due at a tick."""
        since = tick - self._start
        if since >= 0 and self._every is not None:
            since %= self._every
        return 0 <= since < self._duration

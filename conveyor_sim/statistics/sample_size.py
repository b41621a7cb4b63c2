"""Number of runs for an interval of a given width, or for a significant difference."""

from __future__ import annotations

import math
from collections.abc import Callable

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, t_quantile

POWER = 0.8
"""Statistical power: probability that the runs of `runs_to_tell` show a difference of the estimated size."""

MOST = 10**6
"""Largest number of runs that is considered feasible."""


def runs_for(interval: Interval, half_width: float, confidence: float = CONFIDENCE) -> int | None:
    """Return the number of runs for an interval of `half_width`, or None if it exceeds MOST.

    The scatter is estimated from `interval`, which has confidence `confidence` (Law 2015, 9.4.1). The result is at
    least the present number of runs.
    """
    deviation = _deviation(interval, confidence)
    return _least(interval, lambda runs: t_quantile(runs - 1, confidence) * deviation / math.sqrt(runs) <= half_width)


def runs_to_tell(difference: Interval, confidence: float = CONFIDENCE) -> int | None:
    """Return the pairs of runs that show a difference of this size with probability POWER; None: more than MOST."""
    deviation = _deviation(difference, confidence)

    def enough(runs: int) -> bool:
        wanted = t_quantile(runs - 1, confidence) + t_quantile(runs - 1, 2.0 * POWER - 1.0)
        return wanted * deviation / math.sqrt(runs) <= abs(difference.mean)

    return _least(difference, enough)


def _deviation(interval: Interval, confidence: float) -> float:
    """Return the standard deviation of the values behind an interval."""
    if interval.values < 2:
        return math.inf
    return interval.half_width * math.sqrt(interval.values) / t_quantile(interval.values - 1, confidence)


def _least(interval: Interval, enough: Callable[[int], bool]) -> int | None:
    """Return the least sufficient number of runs, by doubling, then bisection."""
    low = high = max(2, interval.values)
    if enough(low):
        return low
    while not enough(high):
        low, high = high, 2 * high
        if high > MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high

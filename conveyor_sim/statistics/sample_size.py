"""How many runs it takes to know a mean well enough, or to tell a difference from none."""

from __future__ import annotations

import math
from collections.abc import Callable

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, t_quantile

POWER = 0.8
"""Chance that as many runs as `runs_to_tell` says do tell a difference that is as large as it seems."""

MOST = 10**6
"""Runs: beyond this, nobody will make them."""


def runs_for(interval: Interval, half_width: float, confidence: float = CONFIDENCE) -> int | None:
    """Runs for an interval of a half-width, from one of `confidence` that some runs gave; None: more than MOST.

    As the values scatter in those runs (Law 2015, 9.4.1). Not fewer than there are.
    """
    deviation = _deviation(interval, confidence)
    return _least(interval, lambda runs: t_quantile(runs - 1, confidence) * deviation / math.sqrt(runs) <= half_width)


def runs_to_tell(difference: Interval, confidence: float = CONFIDENCE) -> int | None:
    """Pairs of runs that tell a difference of this size from none, with a chance of POWER; None: more than MOST."""
    deviation = _deviation(difference, confidence)

    def enough(runs: int) -> bool:
        wanted = t_quantile(runs - 1, confidence) + t_quantile(runs - 1, 2.0 * POWER - 1.0)
        return wanted * deviation / math.sqrt(runs) <= abs(difference.mean)

    return _least(difference, enough)


def _deviation(interval: Interval, confidence: float) -> float:
    """Standard deviation of the values that an interval was made of."""
    if interval.values < 2:
        return math.inf
    return interval.half_width * math.sqrt(interval.values) / t_quantile(interval.values - 1, confidence)


def _least(interval: Interval, enough: Callable[[int], bool]) -> int | None:
    """The least number of runs that are enough, which more then are, too: by doubling, then halving."""
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

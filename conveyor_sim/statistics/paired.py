"""Paired differences between two points of a study, seed by seed.

Both points run with the same seeds (common random numbers), so a machine that fails early does so in both runs of a
pair. The common effect of failures cancels in the difference, which needs fewer runs than two independent means.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, mean_interval, t_probability

Values = Sequence[float] | NDArray[np.float64]


def differences(first: Values, second: Values) -> NDArray[np.float64]:
    """Return first - second (n,) for pairs of finite values. Raise ValueError for unequal lengths."""
    one, other = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if one.shape != other.shape:
        raise ValueError(f"{one.size} and {other.size} values given, expected pairs: as many of one as of the other")
    apart: NDArray[np.float64] = one - other
    return apart[np.isfinite(apart)]


def paired_difference(first: Values, second: Values, confidence: float = CONFIDENCE) -> Interval:
    """Return the interval of mean(first - second), both (n,) by seed. Raise ValueError for unequal lengths."""
    return mean_interval(differences(first, second), confidence)


def paired_probability(first: Values, second: Values) -> float:
    """Return the p-value of the mean difference (paired t-test); 1 for fewer than two pairs."""
    interval = mean_interval(apart := differences(first, second), CONFIDENCE)
    if interval.values < 2:
        return 1.0
    error = float(apart.std(ddof=1)) / math.sqrt(len(apart))
    if error == 0.0:
        return 0.0 if interval.mean else 1.0
    return t_probability(interval.mean / error, interval.values - 1)


def pairing_gain(first: Values, second: Values) -> float:
    """Return the factor of runs that common seeds save for the same interval.

    The factor is the variance of the difference of independent runs over that of pairs: above 1 where common seeds
    help, NaN for fewer than two pairs, infinite if all pairs have the same difference.
    """
    one, other = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    both = np.isfinite(one - other)
    if both.sum() < 2:
        return math.nan
    apart = float((one[both] - other[both]).var(ddof=1))
    alone = float(one[both].var(ddof=1) + other[both].var(ddof=1))
    return alone / apart if apart else math.inf

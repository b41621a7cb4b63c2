"""Paired differences: what one point of a study has over another, seed by seed.

Both points run with the same seeds (common random numbers), so a machine that fails early does so in both runs of a
pair. What the failures do to both is gone from the difference, which needs fewer runs than two means would.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, mean_interval, t_probability

Values = Sequence[float] | NDArray[np.float64]


def differences(first: Values, second: Values) -> NDArray[np.float64]:
    """First less second (n,), of pairs of which both are finite. Raises ValueError for unequal lengths."""
    one, other = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if one.shape != other.shape:
        raise ValueError(f"{one.size} and {other.size} values given, expected pairs: as many of one as of the other")
    found: NDArray[np.float64] = one - other
    return found[np.isfinite(found)]


def paired_difference(first: Values, second: Values, confidence: float = CONFIDENCE) -> Interval:
    """Mean of first less second, both (n,) by seed in the same order. Raises ValueError for unequal lengths."""
    return mean_interval(differences(first, second), confidence)


def paired_probability(first: Values, second: Values) -> float:
    """Chance of a mean difference as large as this, were there none (paired t-test); 1 with less than two pairs."""
    interval = mean_interval(apart := differences(first, second), CONFIDENCE)
    if interval.values < 2:
        return 1.0
    error = float(apart.std(ddof=1)) / math.sqrt(len(apart))
    if error == 0.0:
        return 0.0 if interval.mean else 1.0
    return t_probability(interval.mean / error, interval.values - 1)


def pairing_gain(first: Values, second: Values) -> float:
    """By how many times more runs the same interval would have needed with seeds of their own for both points.

    Variance of the difference of independent runs over that of pairs: above 1 where the common seeds help. NaN with
    less than two pairs, infinite where all pairs differ by the same.
    """
    one, other = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    both = np.isfinite(one - other)
    if both.sum() < 2:
        return math.nan
    apart = float((one[both] - other[both]).var(ddof=1))
    alone = float(one[both].var(ddof=1) + other[both].var(ddof=1))
    return alone / apart if apart else math.inf

# SPDX-License-Identifier: Apache-2.0
"""Comparisons of the points of a study by paired differences, corrected for their number.

Both points of a pair run with the same seeds (common random numbers), so a machine that fails early does so in both
runs. The common effect of failures cancels in the difference, which needs fewer runs than two independent means.

Without correction, one of twenty equal pairs differs at 95 % confidence by chance. Points that ran with the same seeds
are compared in pairs of runs. Bonferroni intervals hold simultaneously with the stated confidence. The verdict is
Holm's (1979), which has more power at the same error rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

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


@dataclass(frozen=True)
class Difference:
    """Difference of two points: the first minus the second."""

    first: int
    second: int
    """Positions of both points in the argument."""
    interval: Interval
    """Interval; all intervals of a comparison hold simultaneously with its confidence."""
    probability: float
    """P-value, corrected for multiple comparisons."""
    told: bool
    """True if the difference is significant."""


def bonferroni(level: float, count: int) -> float:
    """Return the error probability allowed for each of `count` verdicts, so that any errs with at most `level`."""
    return level / count


def holm(probabilities: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return p-values (n,) corrected by Holm: those below a level are all correct with probability 1 - level."""
    raw = np.asarray(probabilities, dtype=np.float64)
    order = np.argsort(raw, kind="stable")
    corrected = np.empty_like(raw)
    corrected[order] = np.minimum(np.maximum.accumulate(raw[order] * (len(raw) - np.arange(len(raw)))), 1.0)
    return corrected


def compare_paired(points: Sequence[NDArray[np.float64]], confidence: float = CONFIDENCE) -> list[Difference]:
    """Compare each point (n,), by seed, with each later one. Raise ValueError for unequal lengths."""
    pairs = list(combinations(range(len(points)), 2))
    each = 1.0 - bonferroni(1.0 - confidence, max(1, len(pairs)))
    chances = holm([paired_probability(points[one], points[other]) for one, other in pairs])
    return [
        Difference(one, other, paired_difference(points[one], points[other], each), float(chance), bool(told))
        for (one, other), chance, told in zip(pairs, chances, chances < 1.0 - confidence, strict=True)
    ]


def best(points: Sequence[NDArray[np.float64]], highest: bool = True, confidence: float = CONFIDENCE) -> list[int]:
    """Return the positions of the point with the best mean, then of all points not significantly different from it."""
    means = np.array([np.nanmean(values) for values in points])
    top = int(np.argmax(means) if highest else np.argmin(means))
    told = [pair for pair in compare_paired(points, confidence) if pair.told and top in (pair.first, pair.second)]
    worse = {pair.second if pair.first == top else pair.first for pair in told}
    return [top, *(place for place in range(len(points)) if place != top and place not in worse)]

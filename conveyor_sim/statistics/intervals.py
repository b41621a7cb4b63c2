# SPDX-License-Identifier: Apache-2.0
"""Confidence intervals of means and of the ratio of two means, and the runs that a narrower interval takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

CONFIDENCE = 0.95
"""Default confidence of intervals."""


@dataclass(frozen=True)
class Interval:
    """Confidence interval of a mean."""

    mean: float
    half_width: float
    """Half the length of the interval; infinite for a single value."""
    values: int
    """Number of independent values."""

    @property
    def low(self) -> float:
        """Return the lower end."""
        return self.mean - self.half_width

    @property
    def high(self) -> float:
        """Return the upper end."""
        return self.mean + self.half_width

    @property
    def excludes_zero(self) -> bool:
        """Return True if the mean differs significantly from zero."""
        return self.low > 0.0 or self.high < 0.0


def t_quantile(freedom: float, confidence: float) -> float:
    """Return t so that Student's distribution has probability `confidence` between -t and t (Student 1908)."""
    return float(stdtrit(freedom, 0.5 * (1.0 + confidence)))


def t_probability(t: float, freedom: float) -> float:
    """Return the two-sided p-value of `t`: the probability of |t| or more if the true mean is zero."""
    return 2.0 * float(stdtr(freedom, -abs(t)))


def mean_and_variance(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the mean of the finite values of (n,), and its variance: NaN without values, infinite for one value."""
    values = values[np.isfinite(values)]
    if not len(values):
        return math.nan, math.nan
    return float(values.mean()), float(values.var(ddof=1) / len(values)) if len(values) > 1 else math.inf


def mean_interval(values: Sequence[float] | NDArray[np.float64], confidence: float = CONFIDENCE) -> Interval:
    """Return the interval of the mean of independent values (n,), such as one metric of n runs with different seeds.

    Values that are not finite are left out. The interval is exact for normal values, close for means of long runs.
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    mean, variance = mean_and_variance(known)
    if len(known) < 2:
        return Interval(mean, math.inf if len(known) else math.nan, len(known))
    return Interval(mean, t_quantile(len(known) - 1, confidence) * math.sqrt(variance), len(known))


def ratio_interval(
    values: NDArray[np.float64], base: NDArray[np.float64], confidence: float = CONFIDENCE
) -> tuple[float, float] | None:
    """Return both ends of the interval of mean(`values`) / mean(`base`) for independent (n,) and (m,).

    The interval holds all ratios r for which values - r base does not differ significantly from 0 (Fieller 1954), with
    the degrees of freedom of Welch (1947) at the estimated ratio. Return None if the mean of the base may be 0, if
    either has fewer than two values, or if a value is not finite.
    """
    if min(len(values), len(base)) < 2 or not np.isfinite([*values, *base]).all():
        return None
    (mean, variance), (base_mean, base_variance) = mean_and_variance(values), mean_and_variance(base)
    if base_mean == 0.0:
        return None
    ratio = mean / base_mean
    parts = variance, ratio**2 * base_variance
    if sum(parts) == 0.0:
        return ratio, ratio
    freedom = sum(parts) ** 2 / (parts[0] ** 2 / (len(values) - 1) + parts[1] ** 2 / (len(base) - 1))
    t = t_quantile(freedom, confidence)
    below = base_mean**2 - t**2 * base_variance
    if below <= 0.0:
        return None
    spread = t * math.sqrt(mean**2 * base_variance + base_mean**2 * variance - t**2 * variance * base_variance)
    return (mean * base_mean - spread) / below, (mean * base_mean + spread) / below


def paired_ratio_interval(
    values: NDArray[np.float64], base: NDArray[np.float64], confidence: float = CONFIDENCE
) -> tuple[float, float] | None:
    """Return both ends of the interval of mean(`values`) / mean(`base`) for pairs of runs with equal seeds, both (n,).

    The interval holds all ratios r for which the differences values - r base do not differ significantly from 0
    (Fieller 1954, with the covariance of the pairs). Return None as `ratio_interval` does, and for other shapes.
    """
    count = len(values)
    if count < 2 or len(base) != count or not np.isfinite([*values, *base]).all() or not base.any():
        return None
    if np.array_equal(values, base):
        return 1.0, 1.0
    t = t_quantile(count - 1.0, confidence)
    mean, base_mean = float(values.mean()), float(base.mean())
    (variance, shared), (_, base_variance) = t**2 / count * np.cov(values, base)
    square, middle, last = base_mean**2 - base_variance, mean * base_mean - shared, mean**2 - variance
    if square <= 0.0:
        return None
    spread = math.sqrt(max(0.0, middle**2 - square * last))
    return (middle - spread) / square, (middle + spread) / square


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

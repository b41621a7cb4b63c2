# SPDX-License-Identifier: Apache-2.0
"""Values of parameters with their intervals, from independent samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, mean_interval
from conveyor_sim.studies.calibration.read import Measurement


@dataclass(frozen=True)
class Estimate:
    """Value of a parameter, SI."""

    value: float
    low: float
    """Lower end of the interval of confidence CONFIDENCE; NaN if the data determine none."""
    high: float
    words: str
    """Basis of the interval, or the reason why there is none."""

    @property
    def has_interval(self) -> bool:
        """True if the data determine an interval."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def __str__(self) -> str:
        """Return the interval and its basis, for a comment."""
        if not self.has_interval:
            return f"no interval: {self.words}"
        return f"{100.0 * CONFIDENCE:g} %: {self.rounded(self.low)} to {self.rounded(self.high)} ({self.words})"

    def rounded(self, value: float) -> str:
        """Return a value with digits down to a hundredth of the interval, at least 3 and at most 12."""
        digits = 4
        width = self.high - self.low
        if self.has_interval and value != 0.0:
            digits = 12 if width == 0.0 else math.ceil(math.log10(abs(value) / width)) + 2
        return f"{value:.{min(12, max(3, digits))}g}"


def by_sample(rows: Sequence[Measurement]) -> list[list[int]]:
    """Return the indices of the rows of each sample, in order. A row without a sample is one by itself."""
    samples: dict[str | int, list[int]] = {}
    for index, row in enumerate(rows):
        samples.setdefault(row.sample or row.line, []).append(index)
    return list(samples.values())


def sample_means(values: NDArray[np.float64], samples: Sequence[Sequence[int]]) -> NDArray[np.float64]:
    """Return the mean (samples,) of the values (n,) of each sample.

    Repetitions with one bottle are not independent, so a sample counts as one value.
    """
    return np.array([values[list(indices)].mean() for indices in samples])


def mean_estimate(values: NDArray[np.float64], samples: Sequence[Sequence[int]], most: float = math.inf) -> Estimate:
    """Return the mean of the sample means of values (n,), with Student's interval, cut at `most`."""
    interval = mean_interval(sample_means(values, samples))
    count = f"{interval.values} samples" if len(samples) < len(values) else f"{interval.values} rows"
    if interval.values < 2:
        reason = f"{len(values)} rows of one sample" if len(values) > 1 else "one row"
        return Estimate(interval.mean, math.nan, math.nan, reason)
    return Estimate(interval.mean, max(0.0, interval.low), min(most, interval.high), f"t, {count}")

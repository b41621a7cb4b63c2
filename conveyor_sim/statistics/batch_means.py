# SPDX-License-Identifier: Apache-2.0
"""Batch means: confidence interval of a mean from one long run with autocorrelated values.

The run is cut into batches. Their length is doubled until von Neumann's ratio accepts the batch means as independent
(Fishman 1978).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval, mean_interval

MOST, FEWEST = 64, 8
"""Numbers of batches: more make them needlessly short, fewer weaken both the test and the interval."""

LEVEL = 0.1
"""Significance level of the test: large, because treating dependent batches as independent is the costlier error."""


@dataclass(frozen=True)
class BatchMeans:
    """Mean of one long run."""

    interval: Interval
    """Interval from one value per batch."""
    size: int
    """Values per batch."""


def batch_means(series: Sequence[float] | NDArray[np.float64], confidence: float = CONFIDENCE) -> BatchMeans | None:
    """Return the interval of the mean of a series (n,) without its warm-up.

    Values at the start that do not fill a batch are left out. Return None if the series is too short, so that its
    batches depend on each other.
    """
    values = np.asarray(series, dtype=np.float64)
    batches = MOST
    while batches >= FEWEST:
        size = len(values) // batches
        if size:
            means = values[len(values) - batches * size :].reshape(batches, size).mean(axis=1)
            if independent(means):
                return BatchMeans(mean_interval(means, confidence), size)
        batches //= 2
    return None


def independent(values: NDArray[np.float64]) -> bool:
    """Return True if values (n,) may be independent: von Neumann's ratio (1941), one-sided at LEVEL.

    For independent values, the squared differences of neighbours average twice the squared deviations from the mean.
    With positive autocorrelation they average less. 1 - half their ratio is nearly normal with variance
    (n - 2) / (n^2 - 1).
    """
    count, about = len(values), values - values.mean()
    squares = float(np.square(about).sum())
    if squares == 0.0:
        return True
    likeness = 1.0 - float(np.square(np.diff(values)).sum()) / (2.0 * squares)
    return likeness <= float(ndtri(1.0 - LEVEL)) * math.sqrt((count - 2) / (count**2 - 1))

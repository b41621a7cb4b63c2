"""Batch means: the interval of a mean from one long run, whose values depend on those just before.

The run is cut into batches so long that their means are as good as independent. They are taken for that when von
Neumann's ratio does not say otherwise (Fishman 1978): batches are made twice as long until it passes.
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
"""Batches: with more, they are short for nothing; with fewer, neither test nor interval says much."""

LEVEL = 0.1
"""Chance to take independent batches for dependent ones: not small, as the other error is the costly one."""


@dataclass(frozen=True)
class BatchMeans:
    """The mean of one long run."""

    interval: Interval
    """Of as many values as there are batches."""
    size: int
    """Values a batch."""


def batch_means(series: Sequence[float] | NDArray[np.float64], confidence: float = CONFIDENCE) -> BatchMeans | None:
    """Interval of the mean of a series (n,) without its warm-up; None: too short, its batches depend on each other.

    What does not fill a batch is left out at the start.
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
    """Whether values (n,) pass for independent: von Neumann's ratio (1941), one-sided at LEVEL.

    The squares of differences of neighbours are on average twice those from the mean, and less where each is like the
    one before. 1 - half their ratio is nearly normal with a variance of (n - 2) / (n^2 - 1).
    """
    count, about = len(values), values - values.mean()
    squares = float(np.square(about).sum())
    if squares == 0.0:
        return True
    likeness = 1.0 - float(np.square(np.diff(values)).sum()) / (2.0 * squares)
    return likeness <= float(ndtri(1.0 - LEVEL)) * math.sqrt((count - 2) / (count**2 - 1))

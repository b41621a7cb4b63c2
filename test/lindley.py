# SPDX-License-Identifier: Apache-2.0
"""The queue M/M/1: arrivals and services at random, one server. How long one waits is known in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def mean_wait(load: float) -> float:
    """Before service, in the steady state, with services of 1 on average: load / (1 - load) (Erlang 1909)."""
    return load / (1.0 - load)


def waits(load: float, runs: int, customers: int, seed: int, at_start: ArrayLike = 0.0) -> NDArray[np.float64]:
    """Of each customer in some runs, (runs, customers), by Lindley's recursion (1952): w' = max(0, w + s - a).

    at_start: what the first one waits, (runs,) or the same in all. Unrolled, a wait is the sum of all s - a so far,
    less the least that this sum has been, if that is below 0.
    """
    random = np.random.default_rng(seed)
    sums = np.empty((runs, customers))
    sums[:, 0] = at_start
    shape = runs, customers - 1
    sums[:, 1:] = random.exponential(1.0, shape) - random.exponential(1.0 / load, shape)
    np.cumsum(sums, axis=1, out=sums)
    return sums - np.minimum(np.minimum.accumulate(sums, axis=1), 0.0)


def steady_waits(load: float, runs: int, customers: int, seed: int) -> NDArray[np.float64]:
    """The same in the steady state: the first one waits nothing with a chance of 1 - load, else exponentially long."""
    random = np.random.default_rng([seed, 1])
    waiting = random.uniform(size=runs) < load
    return waits(load, runs, customers, seed, np.where(waiting, random.exponential(1.0 / (1.0 - load), runs), 0.0))

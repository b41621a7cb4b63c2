# SPDX-License-Identifier: Apache-2.0
"""Warm-up removal: length of the initial transient of a run.

Rule MSER-5 (White 1997; White, Cobb and Spratt 2000): average five successive values at a time. Of these means, leave
out the first d that minimise the standard error of the mean of the rest. Removing transient values lowers the error;
removing more raises it, because fewer values remain.

If the minimum lies in the second half, the rule calls the series too short. In a steady autocorrelated series this
happens by chance, if a few of the last values lie close together. Therefore the best cut of the first half is used
unless it is the last one of that half, or the mean after the other cut differs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

BATCH = 5
"""Values per mean."""

LEAST = 10
"""Fewest means of BATCH values for the rule."""


SURE = 3.0
"""Standard errors between two means that count as different."""


def warm_up(series: Sequence[float] | NDArray[np.float64], batch: int = BATCH) -> int | None:
    """Return the number of values to leave out of a series (n,) with even time steps; None: the series is too short.

    A series is too short if its mean still changes in the second half, so that the run may not have warmed up. It is
    also too short with fewer than LEAST means, or with a value that is not finite. For runs with several seeds,
    (runs, n), the rule is applied to their mean series. Applied to each run it would be biased for skewed quantities
    such as queues: it would leave out the start of queues that happen to become long.
    """
    values = np.asarray(series, dtype=np.float64)
    if values.ndim == 2:
        values = values.mean(axis=0)
    means = values[: len(values) // batch * batch].reshape(-1, batch).mean(axis=1)
    count = len(means)
    if count < LEAST or not np.isfinite(means).all():
        return None
    left = count - np.arange(count)  # by number of removed means
    about = means - means.mean()
    rest, squares = (np.cumsum(part[::-1])[::-1] / left for part in (about, np.square(about)))
    # The search excludes the last means: the error of two or three values is unreliable.
    error = (np.maximum(squares - np.square(rest), 0.0) / left)[:-BATCH]
    first, best = int(np.argmin(error[: count // 2 + 1])), int(np.argmin(error))
    of_best = math.sqrt(error[first] * left[first] / left[best])  # from the scatter behind `first`
    if first == count // 2 or abs(rest[first] - rest[best]) > SURE * of_best:
        return None
    return first * batch

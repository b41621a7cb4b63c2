"""Warm-up removal: how much of the start of a run says more of how it was started than of the line.

Rule MSER-5 (White 1997; White, Cobb and Spratt 2000): means of five values after the other; of these leave out the
first d for which the standard error of the mean of the rest is least. What is left out at first lowers the error, as it
is off; what is left out beyond that raises it, as less is left.

Where the least error is in the second half, the rule says that the series is too short. In a steady one whose values
depend on those before, that happens by chance: a few of the last ones may lie close together. So the best cut of the
first half stands unless it is its last one, or the mean behind the other one differs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

BATCH = 5
"""Values a mean."""

LEAST = 10
"""Means of BATCH values that a series must have for the rule."""


SURE = 3.0
"""Standard errors between two means that are taken for different."""


def warm_up(series: Sequence[float] | NDArray[np.float64], batch: int = BATCH) -> int | None:
    """How many values of a series (n,), at even times, to leave out; None: it is too short to say.

    That is where the mean still changes in the second half, so that the run may never have warmed up, or with less than
    LEAST means, or where one is not finite. Of runs with many seeds, (runs, n), the rule is put to their mean series.
    To put it to each run by itself would be wrong for what is skewed, such as queues: it leaves out the start of those
    that happen to get long.
    """
    values = np.asarray(series, dtype=np.float64)
    if values.ndim == 2:
        values = values.mean(axis=0)
    means = values[: len(values) // batch * batch].reshape(-1, batch).mean(axis=1)
    count = len(means)
    if count < LEAST or not np.isfinite(means).all():
        return None
    left = count - np.arange(count)  # by how many are left out
    about = means - means.mean()
    rest, squares = (np.cumsum(part[::-1])[::-1] / left for part in (about, np.square(about)))
    # The last ones are left out of the search: the error of two or three values may be anything.
    error = (np.maximum(squares - np.square(rest), 0.0) / left)[:-BATCH]
    first, best = int(np.argmin(error[: count // 2 + 1])), int(np.argmin(error))
    of_best = math.sqrt(error[first] * left[first] / left[best])  # of so few, as they scatter behind the first one
    if first == count // 2 or abs(rest[first] - rest[best]) > SURE * of_best:
        return None
    return first * batch

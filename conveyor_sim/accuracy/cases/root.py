"""Root of a scalar function."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import bisect

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Tolerance of the root: the finest that scipy allows."""


def root(rising: Callable[[float], float], below: float, above: float) -> float:
    """Return the root of a function that is <= 0 at `below` and >= 0 at `above`, to the last digits.

    The function may be infinite at both ends. Raise ValueError for other signs.
    """
    return float(bisect(rising, below, above, xtol=1e-300, rtol=ROUNDING, maxiter=2000))

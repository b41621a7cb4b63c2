"""Where a function is 0."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import bisect

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Of the root: as near as scipy allows."""


def root(rising: Callable[[float], float], below: float, above: float) -> float:
    """Where a function that is not over 0 at `below` and not under 0 at `above` is 0, to the last digits.

    It may be infinite at both. ValueError if its signs are otherwise.
    """
    return float(bisect(rising, below, above, xtol=1e-300, rtol=ROUNDING, maxiter=2000))

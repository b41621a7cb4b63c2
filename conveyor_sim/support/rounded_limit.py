# SPDX-License-Identifier: Apache-2.0
"""Limits as a sender with fewer digits states them: the REAL nearest to 0.6 is 0.60000002384, and means 0.6."""

import math
import struct
from collections.abc import Callable


def single(value: float) -> float:
    """Return the nearest number of 32 bits (binary32 of IEEE 754), infinite beyond their range."""
    try:
        (nearest,) = struct.unpack("<f", struct.pack("<f", value))
    except OverflowError:
        return math.copysign(math.inf, value)
    return float(nearest)


def at_limit(value: float, low: float, high: float, rounded: Callable[[float], float] = single) -> float:
    """Return the limit that the sender's type rounds to this value; else the value itself.

    value, low, high: in the same unit. rounded: returns the number that the sender's type or scale has for a limit.
    """
    if value in (low, high) or not math.isfinite(value):
        return value
    for limit in (low, high):
        if math.isfinite(limit) and rounded(limit) == value:
            return limit
    return value

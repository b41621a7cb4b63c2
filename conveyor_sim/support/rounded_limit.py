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
    return limits_by_rounding(low, high, rounded).get(value, value)


def limits_by_rounding(low: float, high: float, rounded: Callable[[float], float] = single) -> dict[float, float]:
    """Return the limits that differ from the numbers that the sender's type has for them, by these numbers.

    low, high, rounded: as for `at_limit`.
    """
    numbers = {rounded(limit): limit for limit in (high, low) if math.isfinite(limit)}
    return {number: limit for number, limit in numbers.items() if number not in (low, high) and math.isfinite(number)}

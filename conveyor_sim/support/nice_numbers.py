# SPDX-License-Identifier: Apache-2.0
"""Round numbers for axes and ranges: 1, 2 or 5 times a power of ten."""

import math


def nice_below(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that does not exceed `value` > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-12))


def nice_above(value: float) -> float:
    """Return the smallest of 1, 2, 5 times a power of ten that is not below `value` > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * (1.0 - 1e-12))

# SPDX-License-Identifier: Apache-2.0
"""A limit rounded by a sender's type is the limit; every other value is unchanged, bit for bit."""

import math
import struct

import numpy as np
import pytest

from conveyor_sim.support.rounded_limit import at_limit, single


def up(value: float) -> float:
    """Return the next number of 32 bits."""
    return float(np.nextafter(np.float32(value), np.float32(np.inf)))


def down(value: float) -> float:
    return float(np.nextafter(np.float32(value), np.float32(-np.inf)))


@pytest.mark.parametrize("limit", [0.6, 0.7, 0.1, 1 / 3, 1e-8, 123456.789, 2.0**-140 * 1.1, 1.0, 2.0**31])
def test_a_limit_of_32_bits_is_the_limit_and_its_neighbours_are_not(limit: float) -> None:
    for low, high in ((-1.0, limit), (limit, 1e12)):
        assert at_limit(single(limit), low, high) == limit
        assert at_limit(up(limit), low, high) == up(limit)
        assert at_limit(down(limit), low, high) == down(limit)
    assert at_limit(-single(limit), -limit, limit) == -limit


@pytest.mark.parametrize("value", [0.25, 0.60000002, 0.61, -0.0, 1e300, -1e300, math.inf, -math.inf])
def test_other_values_keep_their_bits(value: float) -> None:
    for low, high in ((0.0, 0.6), (-math.inf, math.inf), (-1e300, 1e300)):
        assert struct.pack("<d", at_limit(value, low, high)) == struct.pack("<d", value)
    assert math.isnan(at_limit(math.nan, 0.0, 0.6))


def test_a_limit_beyond_32_bits_is_no_value() -> None:
    assert single(1e300) == math.inf and single(-1e300) == -math.inf
    assert at_limit(float(np.finfo(np.float32).max), 0.0, 1e300) == float(np.finfo(np.float32).max)


def test_a_scale_rounds_as_well() -> None:
    def there_and_back(limit: float) -> float:
        return single(limit * 60.0) / 60.0

    assert at_limit(single(1.234567891 * 60.0) / 60.0, 0.0, 1.234567891, there_and_back) == 1.234567891
    assert at_limit(single(1.2345 * 60.0) / 60.0, 0.0, 1.234567891, there_and_back) != 1.234567891

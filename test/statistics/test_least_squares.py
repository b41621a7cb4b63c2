# SPDX-License-Identifier: Apache-2.0
"""Profile intervals of one nonlinear parameter."""

from __future__ import annotations

import math

import numpy as np
import pytest

from conveyor_sim.statistics.intervals import CONFIDENCE, t_quantile
from conveyor_sim.statistics.least_squares import profile

X = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
Y = np.array([2.1, 3.9, 6.2, 7.8, 10.1])


def squares_of_slope(slope: float) -> float:
    return float(((Y - slope * X) ** 2).sum())


def test_a_linear_parameter_has_the_interval_of_regression() -> None:
    slope = float(X @ Y) / float(X @ X)
    error = math.sqrt(squares_of_slope(slope) / 4 / float(X @ X))
    found = profile(squares_of_slope, 1.0, 4.0, freedom=4)
    assert found.best == pytest.approx(slope, rel=1e-7)
    half = t_quantile(4, CONFIDENCE) * error
    assert (found.low, found.high) == pytest.approx((slope - half, slope + half), rel=1e-7)
    assert not found.open_below and not found.open_above


def test_the_search_may_be_logarithmic() -> None:
    linear, logarithmic = (profile(squares_of_slope, 0.5, 50.0, 4, logarithmic=choice) for choice in (False, True))
    assert logarithmic.low == pytest.approx(linear.low, rel=1e-6)
    assert logarithmic.high == pytest.approx(linear.high, rel=1e-6)


def test_an_interval_is_open_where_the_data_exclude_nothing() -> None:
    def squares(value: float) -> float:
        return 1.0 + max(0.0, 2.0 - value) ** 2

    found = profile(squares, 0.0, 10.0, freedom=3)
    assert found.open_above and found.high == 10.0
    assert not found.open_below and 0.0 < found.low < 2.0


def test_exact_data_have_an_interval_without_width() -> None:
    found = profile(lambda value: (value - 3.0) ** 2, 0.0, 10.0, freedom=3)
    assert found.low <= 3.0 + 1e-6 and found.high >= 3.0 - 1e-6
    assert found.high - found.low < 1e-5


def test_no_interval_without_freedom() -> None:
    with pytest.raises(ValueError, match="0 degrees of freedom"):
        profile(squares_of_slope, 1.0, 4.0, freedom=0)

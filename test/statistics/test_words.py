# SPDX-License-Identifier: Apache-2.0
"""Sentences on intervals and differences."""

import math

import pytest
from facts import missing

from conveyor_sim.statistics.intervals import Interval
from conveyor_sim.statistics.words import plus_minus, told


@pytest.mark.parametrize(
    ("interval", "text"),
    [
        (Interval(73.234, 2.13, 10), "73.2 ± 2.1 %"),
        (Interval(0.0012345, 0.000052, 10), "0.001234 ± 0.000052 %"),
        (Interval(1234.5, 210.0, 10), "1234 ± 210 %"),
        (Interval(-0.001, 0.5, 10), "0.00 ± 0.50 %"),
        (Interval(5.0, 0.0, 3), "5 ± 0 %"),
        (Interval(5.0, 1e-15, 3), "5 ± 0 %"),
        (Interval(5.0, math.inf, 1), "5 % (a single run)"),
        (Interval(math.nan, math.nan, 0), "not known"),
    ],
)
def test_a_mean_has_the_digits_that_are_known(interval: Interval, text: str) -> None:
    assert plus_minus(interval, "%") == text


def test_what_can_be_told_is_said() -> None:
    said = told(Interval(0.8, 0.5, 20), "A", "B", "%")
    assert "+0.80 ± 0.50 %, is significant with 20 seeds" in said
    assert said.endswith("A is higher than B")
    assert told(Interval(-0.8, 0.5, 20), "A", "B").endswith("B is higher than A")


def test_a_difference_that_is_not_significant_comes_with_the_seeds_that_would_show_it() -> None:
    said = told(Interval(0.3, 0.5, 20), "A", "B", "%")
    assert missing(said, ["not significant", "20 seeds"]) == [] and "+0.30 ± 0.50 %" in said
    assert "about 110 seeds" in said
    assert missing(told(Interval(0.0, 0.5, 20), "A", "B"), ["no", "number of seeds"]) == []
    assert told(Interval(0.0, 0.0, 5), "A", "B").endswith("are equal with each of 5 seeds")
    assert missing(told(Interval(0.3, math.inf, 1), "A", "B"), ["1 seed", "no", "number of seeds"]) == []

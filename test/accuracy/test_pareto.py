# SPDX-License-Identifier: Apache-2.0
"""The front holds what nothing beats, and nothing else."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest
from accuracy.studies import errors, failed, point, points

from conveyor_sim.accuracy.report.pareto import front
from conveyor_sim.accuracy.results import Cost, Point


def at(cost: float, error: float, stiffness: float = 1.0) -> Point:
    return replace(point("rk4", 100, stiffness), cost=Cost(cost, cost, cost), errors=errors(error), resting=None)


def place(of: Point) -> tuple[float, float]:
    assert of.cost is not None and of.errors is not None
    return of.cost.median, of.worst


def beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one != other and one[0] <= other[0] and one[1] <= other[1]


@pytest.mark.parametrize("seed", range(20))
def test_the_front_is_what_no_other_beats(seed: int) -> None:
    rng = random.Random(seed)
    # Few levels, so that there are ties in cost, in error and in both.
    cloud = [at(rng.randint(1, 8), rng.randint(1, 8) / 100.0) for _ in range(30)]
    places = sorted(place(p) for p in cloud if not any(beats(place(other), place(p)) for other in cloud))
    assert [place(p) for p in front(cloud)] == places


def test_the_larger_error_counts() -> None:
    """What is exact in impacts alone is beaten by what is exact in both."""
    creeps, both = replace(at(1.0, 0.001), resting=0.06), replace(at(2.0, 0.002), resting=0.001)
    assert front([creeps, both, replace(at(3.0, 0.001), resting=0.05)]) == [creeps, both]


def test_failures_are_left_out() -> None:
    good, blown = at(2.0, 0.1), failed("rk4", 10, "unstable")
    lost = replace(at(1.0, 0.01), failure="tunnelling: bottle 3")
    undefined = at(1.0, math.nan)
    assert front([blown, good, lost, undefined]) == [good]
    assert front([blown]) == front([]) == []


def test_settings_beyond_a_bound_of_stability_are_left_out_and_hide_nothing() -> None:
    good, shaky = at(2.0, 0.1), replace(at(1.0, 0.01), beyond=1.01)
    assert front([shaky, good]) == [good]
    assert front([replace(shaky, beyond=1.0), good]) == [replace(shaky, beyond=1.0)]


def test_softened_settings_are_in_or_out() -> None:
    stiff, soft = at(2.0, 0.1), at(1.0, 0.4, stiffness=0.25)
    assert front([stiff, soft]) == [soft, stiff]
    assert front([stiff, soft], softened=False) == [stiff]


def test_a_softened_setting_that_is_out_hides_nothing() -> None:
    stiff, soft = at(2.0, 0.1), at(1.0, 0.01, stiffness=0.25)
    assert front([stiff, soft]) == [soft]
    assert front([stiff, soft], softened=False) == [stiff]


def test_from_the_cheapest_to_the_exactest() -> None:
    places = [place(p) for p in front(points())]
    assert places == sorted(places)
    assert [error for _, error in places] == sorted((error for _, error in places), reverse=True)

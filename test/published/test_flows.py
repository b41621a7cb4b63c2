# SPDX-License-Identifier: Apache-2.0
"""Flow through outlets as in published experiments, with fewer discs: belt speed, funnel angle, jams."""

from statistics import mean
from typing import Any

import pytest
from published.studies import module

HOPPER, JAMS = module("hopper"), module("to_2001")


def flow(outlet: float, angle: float, speed: float = 0.1, **more: Any) -> float:
    """Return the mean rate of two packings, discs/s."""
    setup = {"discs": 220, "width": 16.0, **more}
    runs = (HOPPER.Hopper(outlet, angle, speed=speed, seed=seed, **setup) for seed in (1, 2))
    return mean(HOPPER.discharge(run, 80, 2.0).rate(20, 80) for run in runs)


def test_flow_is_proportional_to_the_belt_speed() -> None:
    """Aguirre et al. 2010."""
    assert flow(8.0, 0.0, 0.1) / flow(8.0, 0.0, 0.05) == pytest.approx(2.0, rel=0.15)


def test_flow_grows_with_the_funnel_angle_to_a_plateau() -> None:
    """Wang et al. 2020: by 24 % from a flat bottom with an outlet of 6 d; 1 % from 60 to 80 degrees with 10 d."""
    flat, steep, steeper = (flow(6.0, angle) for angle in (0.0, 60.0, 75.0))
    assert flat < 0.9 * steep
    assert steeper == pytest.approx(steep, rel=0.15)


@pytest.mark.parametrize(("outlet", "jams"), [(2.0, 3), (8.0, 0)])
def test_springs_jam_at_small_outlets_only(outlet: float, jams: int) -> None:
    """To, Lai and Pak 2001."""
    runs = (JAMS.hopper("springs", 30.0, outlet, seed) for seed in (1, 2, 3))
    assert sum(len(HOPPER.discharge(run, 100, 0.6).times) < 100 for run in runs) == jams


def test_the_first_packing_lies_between_the_walls() -> None:
    """All discs are apart, in front of the outlet, and at least a radius from the walls."""
    hopper = HOPPER.Hopper(6.0, 60.0, 300, 16.0, 0.1, 1)
    places = HOPPER.places(hopper) / HOPPER.DIAMETER
    assert places.shape == (300, 2)
    assert places[:, 0].max() < -0.5
    assert abs(places[:, 1]).max() < 7.5

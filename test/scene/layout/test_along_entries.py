# SPDX-License-Identifier: Apache-2.0
"""Bottles that come onto the line along a conveyor: speed of the belt, and scatter that the guides leave."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scene.layout.along_line import RADIUS, Data, expansion, lane, placed
from scenes import kind

from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.simulation import Simulation

HALF_DEGREE = math.radians(0.5)


def feed(conveyor: Data | None = None, scene: Data | None = None, **fields: Any) -> Infeed:
    """An infeed along a conveyor."""
    given = {"bottle": "bottle", "along": "lane", "at": 0.2, "rate": 1.0, **fields}
    return placed({"lane": conveyor or lane()}, infeeds={"feed": given}, **(scene or {})).infeeds["feed"]


@pytest.mark.parametrize(
    ("conveyor", "at", "speed"),
    [
        ({"speed": 0.3}, 0.2, 0.3),
        ({"speed": "30 m/min"}, 0.2, 0.5),
        ({"speed": -0.3}, 0.2, 0.0),
        ({"speed": None, "drive": "m1", "ratio": 2}, 0.2, 0.4),
        ({"drive": {"acceleration": 1.0}}, 0.2, 0.4),
        ({"sections": [{"name": "a", "to": 1}, {"name": "b", "speed": 0.7}]}, 0.2, 0.4),
        ({"sections": [{"name": "a", "to": 1}, {"name": "b", "speed": 0.7}]}, 2.0, 0.7),
    ],
)
def test_bottles_have_the_speed_of_the_belt(conveyor: Data, at: float, speed: float) -> None:
    """The section at the station counts, and a named drive times the ratio."""
    fields = {name: value for name, value in lane(**conveyor).items() if value is not None}
    scene = {"drives": {"m1": {"speed": "12 m/min", "acceleration": 1.0}}}
    assert feed(fields, scene, at=at).speed == speed
    assert feed(fields, scene, at=at, speed="0.1 m/s").speed == 0.1


def test_bottles_have_the_speed_of_their_lane() -> None:
    """Lanes count from the right."""
    lanes = [{"width": 0.1, "ratio": 0.5}, {"width": 0.1}, {"width": 0.1, "ratio": 1.5}]
    conveyor = {name: value for name, value in lane(lanes=lanes).items() if name not in ("width", "guides")}
    assert [feed(conveyor, offset=offset).speed for offset in (-0.1, 0.0, 0.1)] == [0.2, 0.4, pytest.approx(0.6)]


@pytest.mark.parametrize(
    ("clearance", "offset", "lateral", "angular"),
    [
        (0.08, 0.0, 5e-4, HALF_DEGREE),
        (2 * RADIUS + 4e-4, 0.0, 2e-4, HALF_DEGREE),
        (0.07, 0.0018, 2e-4, HALF_DEGREE),
        (0.07, -0.0018, 2e-4, HALF_DEGREE),
        (2 * RADIUS, 0.0, 0.0, 0.0),
    ],
)
@pytest.mark.parametrize("at", [0.2, 1.4])
def test_scatter_is_at_most_what_the_guides_leave(
    clearance: float, offset: float, lateral: float, angular: float, at: float
) -> None:
    """To the nearer guide, on straight pieces and in bends. Without room there is none."""
    infeed = feed(lane(guides={"clearance": clearance, "material": "steel"}), at=at, offset=offset)
    assert infeed.lateral_jitter == pytest.approx(lateral, abs=1e-12)
    assert infeed.angular_jitter == angular


def test_a_funnel_leaves_less() -> None:
    """The guide comes nearer within a radius along the path."""
    right = [[0, -0.04], [0.5, -RADIUS]]
    guides = {"f": {"along": "lane", "right": right, "material": "steel"}}
    conveyor = {name: value for name, value in lane().items() if name != "guides"}
    infeed = feed(conveyor, {"guides": guides}, at=0.45)
    assert 0.0 < infeed.lateral_jitter < 0.05 / 0.5 * (0.04 - RADIUS)


def test_scatter_can_be_set_and_turned_off() -> None:
    """Fields of the device take precedence; devices in coordinates have none."""
    infeed = feed(lateral_jitter="1 mm", angular_jitter=0)
    assert (infeed.lateral_jitter, infeed.angular_jitter) == (0.001, 0.0)
    coordinates = {"bottle": "bottle", "position": [0.2, 0.0], "direction": 0.0, "speed": 0.4, "rate": 1.0}
    plain = placed(infeeds={"feed": coordinates}).infeeds["feed"]
    assert (plain.lateral_jitter, plain.angular_jitter) == (0.0, 0.0)


def test_a_station_scatters_by_the_largest_bottle() -> None:
    """Any bottle may come to it."""
    types = {"bottle": kind(RADIUS, 0.35), "large": kind(0.0398, 0.5)}
    machine = {"kind": "station", "along": "lane", "at": 0.3, "length": 0.1, "out": {"along": "lane", "at": 0.5}}
    fields = {"bottle_types": types, "machines": {"capper": {**machine, "rate": 1.0}}}
    station = placed(None, **fields).machines["capper"]
    assert station.lateral_jitter == pytest.approx(0.04 - 0.0398)
    assert station.position == (0.5, 0.0)


def test_a_station_may_have_its_region_or_its_exit_in_coordinates() -> None:
    """Both places are independent."""
    region, position = [[0.2, -0.05], [0.3, -0.05], [0.3, 0.05], [0.2, 0.05]], [0.5, 0.0]
    out, along = {"out": {"along": "lane", "at": 0.5}}, {"along": "lane", "at": 0.3, "length": 0.1}
    heading = {"position": position, "direction": 0.0, "speed": 0.4}
    for fields in ({"region": region, **out}, {**along, **heading}):
        machines = {"capper": {"kind": "station", **fields, "rate": 1.0}}
        station = expansion(machines=machines).data["machines"]["capper"]
        assert station["position"] == position
        assert station["region"] == [pytest.approx(corner) for corner in region]
        assert ("lateral_jitter" in station) == ("out" in fields)


@pytest.mark.parametrize(("fields", "is_column"), [({}, False), ({"lateral_jitter": 0, "angular_jitter": 0}, True)])
def test_bottles_on_a_table_stand_in_a_column_only_without_scatter(fields: Data, is_column: bool) -> None:
    """30 bottles from the middle of a lane, behind a rail at the end of a table of 0.6 m."""
    path, material = [{"straight": 1.0}], "chain"
    conveyors = {
        "lane": {"start": [0, 0], "path": path, "width": 0.09, "material": material, "speed": 0.4},
        "table": {"after": "lane", "path": [{"straight": 2.0}], "width": 0.6, "material": material, "speed": 0.1},
    }
    sides = {"left": [[0.0, 0.04], [0.99, 0.04], [1.0, 0.3]], "right": [[0.0, -0.04], [0.99, -0.04], [1.0, -0.3]]}
    sim = Simulation(
        placed(
            conveyors,
            duration=60.0,
            accuracy="draft",
            friction_solver="implicit",
            guides={"walls": {"along": ["lane", "table"], "material": "steel", **sides}},
            rails={"end": {"along": "table", "at": "end", "material": "steel"}},
            infeeds={"feed": {"bottle": "bottle", "along": "lane", "at": 0.05, "rate": 1.5, "count": 30, **fields}},
        )
    )
    sim.advance(4000)
    y = sim.bottles().y
    assert len(y) == 30
    assert (np.ptp(y) == 0.0) == is_column
    assert is_column or np.ptp(y) > 0.2

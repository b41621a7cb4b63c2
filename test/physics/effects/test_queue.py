# SPDX-License-Identifier: Apache-2.0
"""The longest queue that a line has room for: lengths of belts that follow each other, over the pitch of bottles."""

import math
from typing import Any

import pytest
from scenes import RADIUS, belt, scene, segment
from swept import fields, file_of

from conveyor_sim.physics.effects.load import ROWS
from conveyor_sim.physics.effects.queue import longest_queue
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

NARROW, WIDE = 2.2 * RADIUS, 1.0
FILE, CROWD = 2.0 * RADIUS, 2.0 * RADIUS * ROWS
FEED = {"bottle": "bottle", "position": [0.1, 0.0], "direction": 0.0, "speed": 0.3, "rate": 1.0}


def queue(belts: dict[str, Any], rails: dict[str, Any] | None = None, **more: Any) -> int:
    """Return the bottles in the longest queue of belts that an endless infeed fills."""
    given = fields()
    parts = {"bottle_types": {"bottle": given["bottle_types"]["bottle"]}, "infeeds": {"inlet": FEED}}
    made = scene(**parts, contacts=given["contacts"], base=given["base"], belts=belts, rails=rails or {}, **more)
    return longest_queue(Plant.of(made))[0]


def lane(x: float, y: float, length: float, width: float = NARROW, speed: float = 0.3) -> dict[str, Any]:
    """Return a belt along x with its middle at y."""
    return belt(speed, (x, y - 0.5 * width), length, width)


def bottles(length: float, pitch: float = FILE) -> int:
    return math.floor(length / pitch + 1e-9)


def test_few_bottles_are_all_in_it() -> None:
    few = scene(**fields(**file_of(12)))
    assert longest_queue(Plant.of(few)) == (12, "all bottles, one behind the other")


def test_a_crowd_counts_by_its_rows() -> None:
    """A belt of 1 m holds 15 bottles in a row: 6.5 m of it hold a queue of 114 in a mass of 1 500."""
    assert queue({"lane": lane(0.0, 0.0, 6.5)}) == bottles(6.5)
    assert queue({"table": lane(0.0, 0.0, 6.5, WIDE)}) == bottles(6.5, CROWD)


def test_belts_that_follow_each_other_hold_one_queue() -> None:
    crowd, file = 4.0 / CROWD, 3.0 / FILE
    both = {"table": lane(0.0, 0.0, 4.0, WIDE), "lane": lane(4.0, 0.0, 3.0)}
    assert queue(both) == math.floor(crowd + file)
    assert queue({**both, "table": lane(-0.1, 0.0, 4.0, WIDE)}) == max(math.floor(crowd), bottles(3.0))
    gap = {"plates": {"gap": {"kind": "straight", "start": [-0.1, -0.05], "angle": 0.0, "length": 0.1,
                              "width": 0.1, "material": "chain"}}}  # fmt: skip
    bridged = {"lane": lane(-2.1, 0.0, 2.0), "on": lane(0.0, 0.0, 3.0)}
    assert queue(bridged) == bottles(3.0)
    assert queue(bridged, **gap) == bottles(5.1)


def test_a_branch_counts_with_its_longest_lane() -> None:
    """A table of 2 m feeds lanes of 3 m and 5 m."""
    lanes = {f"lane{i}": lane(2.0, y, long) for i, (y, long) in enumerate([(-0.2, 3.0), (0.2, 5.0)])}
    assert queue({"table": lane(0.0, 0.0, 2.0, WIDE), **lanes}) == math.floor(2.0 / CROWD + 5.0 / FILE)


@pytest.mark.parametrize(("speed", "count"), [(0.3, bottles(6.0)), (-0.3, bottles(12.0))])
def test_lanes_side_by_side_hold_one_queue_only_if_they_run_against_each_other(speed: float, count: int) -> None:
    assert queue({"one": lane(0.0, 0.0, 6.0), "other": lane(0.0, NARROW, 6.0, speed=speed)}) == count


def test_a_rail_across_ends_a_queue() -> None:
    """Across a lane of 10 m at 6.5 m. One along it, and one beside which a bottle passes, end nothing."""
    line = {"lane": lane(0.0, 0.0, 4.0), "on": lane(4.0, 0.0, 6.0)}
    assert queue(line, {"stop": segment((6.5, -0.05), (6.5, 0.05))}) == bottles(6.5)
    assert queue(line, {"guide": segment((1.0, 0.5 * NARROW), (6.5, 0.5 * NARROW))}) == bottles(10.0)
    table = {"table": lane(0.0, 0.0, 10.0, WIDE)}
    assert queue(table, {"half": segment((6.5, -0.5), (6.5, 0.1))}) == bottles(10.0, CROWD)
    assert queue(table, {"end": segment((6.5, -0.5), (6.5, 0.5))}) == bottles(6.5, CROWD)


def test_a_loop_counts_each_belt_once() -> None:
    plant = Plant.of(load_scene(scene_path("paper_plant")))
    length = sum(shape.running_length for shape in plant.surfaces)
    assert longest_queue(plant)[1] == f"{length:.3g} m of feeder to return_belt, full"

# SPDX-License-Identifier: Apache-2.0
"""Surfaces of belts and plates: order, names, senses of travel, exact directions."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import base, belt, scene

from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.plant_arrays import belt_arrays
from conveyor_sim.scene import belt_shapes, surface_shapes
from conveyor_sim.scene.geometry import BeltShape, named_surfaces, surface_materials

QUARTERS = [pytest.param(number, id=f"{90 * number} deg") for number in range(-4, 5)]
EXACT = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]


def strip(y: float = 0.0, length: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"kind": "straight", "start": [0.0, y], "angle": 0.0, "length": length, "width": 0.1, **more}


def sector(turn: str) -> BeltShape:
    ring = {"kind": "curved", "centre": [1.0, 2.0], "inner_radius": 0.5, "width": 0.2, "start_angle": 0.3, "span": 1.1,
            "turn": turn, "material": "chain"}  # fmt: skip
    (shape,) = belt_shapes(scene(base=base(0.4), belts={"bend": ring}))
    return shape


def test_surfaces_follow_the_order_of_belts_and_plates_come_last() -> None:
    path = {"kind": "path", "material": "chain", "surfaces": [strip(), strip(0.1, ratio=1.5)]}
    nylon = {"between": ["glass", "nylon"], "friction": 0.2}
    line = scene(
        base=[*base(0.4), nylon],
        plates={"dead": strip(5.0, material="nylon")},
        belts={"first": belt(0.1), "lane": path, "last": belt(0.2)},
    )
    shapes = surface_shapes(line)
    assert [shape.name for shape in shapes] == ["first", "lane_1", "lane_2", "last", "dead"]
    assert [shape.belt for shape in shapes] == [0, 1, 1, 2, None]
    assert [shape.ratio for shape in shapes] == [1.0, 1.0, 1.5, 1.0, 1.0]
    assert [shape.outermost for shape in shapes] == [1.0, 1.0, 1.5, 1.0, 0.0]
    assert surface_materials(line) == [shape.material for shape in shapes] == ["chain"] * 4 + ["nylon"]
    assert belt_shapes(line) == shapes[:4]


def test_a_belt_is_named_on_its_longest_surface_and_in_the_middle_of_lanes() -> None:
    lanes = {"kind": "path", "material": "chain", "surfaces": [strip(0.1 * lane) for lane in range(3)]}
    pieces = {"kind": "path", "material": "chain", "surfaces": [strip(1.0), strip(2.0, 3.0), strip(3.0, 2.0)]}
    shapes = belt_shapes(scene(base=base(0.4), belts={"lanes": lanes, "pieces": pieces}))
    assert {belt: shape.name for belt, shape in named_surfaces(shapes).items()} == {0: "lanes_2", 1: "pieces_2"}


def test_a_right_hand_bend_has_the_same_area_and_runs_the_other_way() -> None:
    left, right = sector("left"), sector("right")
    np.testing.assert_array_equal(right.outline(), left.outline())
    np.testing.assert_array_equal(right.centre_line(), left.centre_line()[::-1])
    for mine, other in zip(right.edges(), reversed(left.edges()), strict=True):
        np.testing.assert_array_equal(mine, other[::-1])


@pytest.mark.parametrize("quarters", QUARTERS)
def test_directions_at_quarter_turns_are_exact(quarters: int) -> None:
    angle, right_angle = f"{90 * quarters} deg", 0.5 * math.pi * quarters
    ring = {"kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.5, "width": 0.5, "start_angle": angle,
            "span": "90 deg", "material": "chain"}  # fmt: skip
    belts = {"along": belt(0.1, (2.0, 3.0), 4.0, 1.0, angle=right_angle), "bend": ring}
    line = scene(base=base(0.4), belts=belts)
    (cos, sin), (end_x, end_y) = EXACT[quarters % 4], EXACT[(quarters + 1) % 4]
    along, bend = surface_shapes(line)
    corners = [(2.0, 3.0), (2.0 + 4.0 * cos, 3.0 + 4.0 * sin), (2.0 + 4.0 * cos - sin, 3.0 + 4.0 * sin + cos)]
    assert along.outline()[:3].tolist() == [list(corner) for corner in corners]
    assert (bend.outline()[0].tolist(), bend.centre_line()[-1].tolist()) == ([cos, sin], [0.75 * end_x, 0.75 * end_y])
    arrays = belt_arrays(build_model(line).plant.surfaces, 8, 8)
    assert arrays is not None and arrays.sectors is not None
    assert (arrays.ax[0], arrays.ay[0]) == (cos, sin)
    sectors = arrays.sectors
    assert (sectors.start_x[1], sectors.start_y[1], sectors.end_x[1], sectors.end_y[1]) == (cos, sin, end_x, end_y)

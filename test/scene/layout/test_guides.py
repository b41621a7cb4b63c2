# SPDX-License-Identifier: Apache-2.0
"""Guides: along conveyors, in bends, with openings, around points, and the clear width that they leave."""

import math
from typing import Any

import pytest
from scene.layout.layouts import Data, expanded
from scene.layout.written import read

from conveyor_sim.scene.geometry import rail_shapes

QUARTER = math.radians(90)
TABLE: Data = {"start": [0.0, 0.0], "path": [{"straight": 2.5}], "width": 0.6, "material": "chain"}
BEND = [{"straight": 1.0}, {"right": QUARTER, "radius": 0.5}, {"straight": 1.0}]
LANE: Data = {"after": "table", "back": 0.5, "path": BEND, "width": 0.1, "material": "chain"}


def rails(**guide: Any) -> Data:
    """Rails of a guide along a table, and a lane that begins 0.5 m before its end; stations of the lane begin at 2."""
    fields = {"conveyors": {"table": TABLE, "lane": LANE}, "guides": {"g": {"material": "steel", **guide}}}
    data: Data = expanded(**fields).data["rails"]
    return data


def test_a_taper_ends_at_a_clearance_that_holds_in_the_bend_behind_it() -> None:
    parts = rails(along=["table", "lane"], left=[[0, 0.28], [1.9, 0.0375]])
    assert list(parts) == ["g_left_1", "g_left_2", "g_left_3"]
    straight, arc, last = parts.values()
    assert straight["points"] == [[0.0, 0.28], [1.9, 0.0375], [3.0, 0.0375]]
    assert (arc["centre"], arc["radius"]) == ([3.0, -0.5], 0.5375)
    assert (arc["start_angle"], arc["span"]) == (0.0, QUARTER)
    assert last["points"] == [[3.5375, -0.5], [3.5375, -1.5]]


def test_a_side_in_one_piece_has_no_number() -> None:
    assert list(rails(along="table", clearance=0.5)) == ["g_left", "g_right"]
    assert list(rails(along="table", right=[[0, -0.2]], left=[[0, 0.2]])) == ["g_right", "g_left"]


def test_rails_of_one_side_join_end_to_end() -> None:
    guide: Data = {"along": ["table", "lane"], "left": [[0, 0.28], [1.9, 0.0375]], "material": "steel"}
    shapes = rail_shapes(read(conveyors={"table": TABLE, "lane": LANE}, guides={"g": guide}))
    ends = [shape.pieces for shape in shapes]
    assert math.dist(ends[0][-1].ends[1], ends[1][0].ends[1]) < 1e-12  # an arc to the right runs against travel
    assert math.dist(ends[1][0].ends[0], ends[2][0].ends[0]) < 1e-12


def test_an_opening_cuts_a_taper_on_its_line() -> None:
    parts = rails(along="table", left=[[0, 0.3], [2, 0.1]], open={"left": [[0.5, 1.0]]})
    assert [part["points"] for part in parts.values()] == [
        [[0.0, 0.3], [0.5, pytest.approx(0.25)]],
        [[1.0, pytest.approx(0.2)], [2.0, 0.1], [2.5, 0.1]],
    ]


def test_an_opening_in_a_bend_cuts_the_arc() -> None:
    middle = 2.0 + 1.0 + 0.25 * math.pi / 2
    parts = rails(along=["table", "lane"], right=[[0, -0.05]], open={"right": [[middle, middle + 0.1]]})
    arcs = [part for part in parts.values() if part["kind"] == "arc"]
    assert sum(arc["span"] for arc in arcs) == pytest.approx(QUARTER - 0.1 / 0.5)


def test_openings_may_overlap() -> None:
    parts = rails(along="table", clearance=0.5, open={"left": [[1.0, 1.5], [0.5, 1.2]]})
    assert [part["points"][0][0] for part in parts.values()] == [0.0, 1.5, 0.0]


def test_from_and_to_bound_a_guide() -> None:
    left, right = rails(along="table", clearance=0.5, **{"from": 0.5, "to": 2.0}).values()
    assert left["points"] == [[0.5, 0.25], [2.0, 0.25]]
    assert right["points"] == [[0.5, -0.25], [2.0, -0.25]]


def test_guides_of_a_conveyor_cover_the_gap_in_front_of_it() -> None:
    own = {"clearance": 0.075, "material": "steel"}
    following: Data = {"after": "lane", "gap": 0.06, "path": [{"straight": 1}], "width": 0.1, "material": "chain"}
    conveyors = {"table": TABLE, "lane": {**LANE, "guides": own}, "next": {**following, "guides": own}}
    parts = expanded(conveyors=conveyors).data["rails"]
    assert parts["lane_left_3"]["points"][-1] == parts["next_left"]["points"][0]
    assert parts["next_left"]["points"][1] == [3.5375, -2.56]


def test_a_gap_is_part_of_a_joined_path() -> None:
    following: Data = {"after": "table", "gap": 0.1, "path": [{"straight": 1}], "width": 0.1, "material": "chain"}
    guide = {"along": ["table", "next"], "left": [[2.0, 0.1], [3.0, 0.04]], "material": "steel"}
    expansion = expanded(conveyors={"table": TABLE, "next": following}, guides={"g": guide})
    assert expansion.data["rails"]["g_left"]["points"] == [[2.0, 0.1], [3.0, 0.04], [3.6, 0.04]]
    assert expansion.plan is not None
    assert expansion.plan.conveyors["next"].clear(0.4) == (-0.05, 0.04)


def test_guides_around_points_have_mitred_corners() -> None:
    left, right = rails(points=[[0, 0], [1, 0], [1, 1]], clearance=0.2).values()
    assert left["points"] == [[0.0, 0.1], [0.9, 0.1], [0.9, 1.0]]
    assert right["points"] == [[0.0, -0.1], [1.1, -0.1], [1.1, 1.0]]


@pytest.mark.parametrize("degrees", [-120, -60, -17, 5, 45, 90, 130])
def test_both_sides_keep_half_the_clearance_from_each_leg(degrees: int) -> None:
    x, y = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    for part in rails(points=[[0, 0], [1, 0], [1 + x, y]], clearance=0.1).values():
        (_, first), (bx, by), last = part["points"]
        assert abs(first) == pytest.approx(0.05, abs=1e-15)
        assert abs(by) == pytest.approx(0.05, abs=1e-15)
        assert abs((bx - 1) * y - by * x) == pytest.approx(0.05, abs=1e-15)
        assert abs((last[0] - 1) * y - last[1] * x) == pytest.approx(0.05, abs=1e-15)


def test_clear_width_is_that_of_guides_where_there_are_any() -> None:
    guide = {"along": ["table", "lane"], "left": [[0, 0.28], [1.9, 0.0375]], "material": "steel", "to": 3.0}
    plan = expanded(conveyors={"table": TABLE, "lane": LANE}, guides={"g": guide}).plan
    assert plan is not None
    table, lane = plan.conveyors["table"], plan.conveyors["lane"]
    assert table.clear(0.0) == (-0.3, 0.28)
    assert table.clear(2.25) == (-0.3, 0.0375)  # where the lane begins above the table
    assert lane.clear(0.5) == (-0.05, 0.0375)
    assert lane.clear(1.5) == (-0.05, 0.05)


def test_clear_width_follows_guides_around_points_to_the_next_conveyor() -> None:
    a: Data = {"start": [0, 0], "path": [{"straight": 3}], "width": 0.085, "material": "chain"}
    b: Data = {"beside": "a", "side": "left", "from": 1, "gap": 0.005, "path": [{"straight": 4}]}
    guide = {"points": [[0, 0], [1.2, 0], [2, 0.09], [5, 0.09]], "clearance": 0.075, "material": "steel"}
    plan = expanded(conveyors={"a": a, "b": {**b, "width": 0.085, "material": "chain"}}, guides={"s": guide}).plan
    assert plan is not None
    assert plan.conveyors["a"].clear(0.5) == (-0.0375, 0.0375)
    assert plan.conveyors["b"].clear(3.0) == pytest.approx((-0.0375, 0.0375))
    assert plan.conveyors["a"].clear(2.9) == (-0.0425, 0.0425)

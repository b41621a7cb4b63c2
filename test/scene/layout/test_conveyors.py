# SPDX-License-Identifier: Apache-2.0
"""Conveyors: places, pieces, lanes, sections, plates, names and their order."""

import math
from itertools import pairwise
from typing import Any

import pytest
from scene.layout.layouts import Data, expanded
from scene.layout.written import read

from conveyor_sim.scene.geometry import ArcPiece, RailShape, SegmentPiece, rail_shapes
from conveyor_sim.scene.layout.expand import expand

QUARTER = math.radians(90)


def conveyor(**fields: Any) -> Data:
    """A straight chain of 2 m at the origin, unless `fields` say otherwise."""
    placed = {"start", "after", "beside", "points"} & fields.keys()
    place: Data = {} if placed else {"start": [0.0, 0.0]}
    path: Data = {} if "points" in fields else {"path": [{"straight": 2.0}]}
    width: Data = {} if "lanes" in fields else {"width": 0.2}
    return {**place, **path, **width, "material": "chain", "speed": 0.4, **fields}


def belts(**conveyors: Data) -> Data:
    """Expanded belts of conveyors."""
    data: Data = expanded(conveyors=conveyors).data["belts"]
    return data


def test_a_straight_conveyor_is_a_straight_belt_with_its_right_hand_corner() -> None:
    assert belts(lane=conveyor(start=[1.0, 2.0], heading=QUARTER)) == {
        "lane": {
            "kind": "straight",
            "start": [1.1, 2.0],
            "angle": QUARTER,
            "length": 2.0,
            "width": 0.2,
            "material": "chain",
            "speed": 0.4,
        }
    }


@pytest.mark.parametrize(
    ("turn", "centre_y", "start_angle", "inner"),
    [("left", 0.5, -QUARTER, 0.4), ("right", -0.5, 0.0, 0.4)],
)
def test_a_bend_is_a_curved_belt_that_turns_its_way(
    turn: str, centre_y: float, start_angle: float, inner: float
) -> None:
    (belt,) = belts(bend=conveyor(path=[{turn: QUARTER, "radius": 0.5}])).values()
    assert belt["centre"] == [0.0, centre_y]
    assert belt["start_angle"] == start_angle
    assert (belt["inner_radius"], belt["span"], belt["width"]) == (0.4, QUARTER, 0.2)
    assert belt.get("turn", "left") == turn


def test_several_pieces_are_surfaces_of_one_belt() -> None:
    path = [{"straight": 1.0}, {"right": QUARTER, "radius": 0.5}, {"straight": 2.0}]
    expansion = expanded(conveyors={"lane": conveyor(path=path, start=[0.0, 0.0])})
    (belt,) = expansion.data["belts"].values()
    assert belt["kind"] == "path"
    assert [surface["kind"] for surface in belt["surfaces"]] == ["straight", "curved", "straight"]
    assert belt["surfaces"][2]["start"] == [1.4, -0.5]
    assert expansion.plan is not None
    assert expansion.plan.conveyors["lane"].surfaces == ("lane_1", "lane_2", "lane_3")
    assert expansion.sources["belts", "lane", "surfaces", 1] == ("conveyors", "lane", "path", 1)


def test_lanes_share_edges_and_have_their_own_radii() -> None:
    lanes = [{"width": 0.1, "ratio": 0.7}, {"width": 0.1}, {"width": 0.086, "ratio": 1.4}]
    path = [{"straight": 1.0}, {"left": QUARTER, "radius": 0.5}]
    (belt,) = belts(comb=conveyor(path=path, lanes=lanes)).values()
    straight, curved = belt["surfaces"][:3], belt["surfaces"][3:]
    assert [surface.get("ratio", 1.0) for surface in straight] == [0.7, 1.0, 1.4]
    for right, left in pairwise(straight):
        assert right["start"][1] + right["width"] == left["start"][1]
    assert [surface["inner_radius"] for surface in curved] == pytest.approx([0.543, 0.443, 0.357], abs=1e-15)


def test_one_lane_of_ratio_1_is_a_plain_belt() -> None:
    assert belts(one=conveyor(lanes=[{"width": 0.2}])) == belts(one=conveyor())


def test_a_conveyor_after_another_begins_at_its_end() -> None:
    path = [{"straight": 1.0}, {"left": QUARTER, "radius": 0.5}]
    first = conveyor(path=path)
    plans = expanded(conveyors={"next": conveyor(after="first"), "first": first}).plan
    assert plans is not None
    assert list(plans.conveyors) == ["next", "first"]
    assert plans.conveyors["next"].route.start is plans.conveyors["first"].route.end


@pytest.mark.parametrize(
    ("fields", "start"),
    [
        ({"back": 0.4}, (1.6, 0.0)),
        ({"gap": 0.25}, (2.25, 0.0)),
        ({"offset": 0.5}, (2.0, 0.5)),
        ({"gap": 0.25, "offset": -0.5}, (2.25, -0.5)),
    ],
)
def test_back_gap_and_offset_move_the_start(fields: Data, start: tuple[float, float]) -> None:
    plan = expanded(conveyors={"first": conveyor(), "next": conveyor(after="first", **fields)}).plan
    assert plan is not None
    assert plan.conveyors["next"].route.start.xy == start


@pytest.mark.parametrize(("side", "y"), [("left", 0.255), ("right", -0.255)])
def test_a_conveyor_beside_another_is_a_gap_away_from_its_edge(side: str, y: float) -> None:
    fields = {"side": side, "from": 0.5, "gap": 0.005, "width": 0.3, "plate": "nylon"}
    expansion = expanded(conveyors={"a": conveyor(), "b": conveyor(beside="a", **fields)})
    assert expansion.plan is not None
    assert expansion.plan.conveyors["b"].route.start.xy == (0.5, pytest.approx(y, abs=1e-15))
    (plate,) = expansion.data["plates"].values()
    assert (plate["start"][0], plate["length"], plate["width"], plate["material"]) == (0.5, 1.5, 0.005, "nylon")
    assert plate["start"][1] == pytest.approx(0.1 if side == "left" else -0.105, abs=1e-15)


def test_a_plate_beside_a_bend_ends_where_the_paths_part() -> None:
    path = [{"straight": 1.0}, {"left": QUARTER, "radius": 1.0}, {"straight": 1.0}]
    outer = [{"straight": 1.0}, {"left": QUARTER, "radius": 1.25}, {"left": QUARTER, "radius": 1.0}]
    b = conveyor(beside="a", side="right", gap=0.05, plate="nylon", path=outer)
    plates = expanded(conveyors={"a": conveyor(path=path), "b": b}).data["plates"]
    assert list(plates) == ["b_plate_1", "b_plate_2"]
    assert plates["b_plate_2"]["inner_radius"] == pytest.approx(1.1, abs=1e-15)
    assert plates["b_plate_2"]["span"] == QUARTER


def test_a_plate_in_a_gap_is_as_wide_as_both_conveyors() -> None:
    conveyors = {"table": conveyor(width=0.6), "lane": conveyor(after="table", gap=0.06, plate="nylon", offset=0.3)}
    (plate,) = expanded(conveyors=conveyors).data["plates"].values()
    assert plate["start"] == [2.0, -0.3]
    assert plate["length"] == 0.06
    assert plate["width"] == pytest.approx(0.7, abs=1e-15)


def test_sections_are_belts_of_their_own() -> None:
    sections = [{"name": "z1", "to": 0.5}, {"name": "z2", "speed": 0.6, "material": "rubber"}]
    expansion = expanded(conveyors={"lane": conveyor(sections=sections)})
    z1, z2 = expansion.data["belts"]["lane_z1"], expansion.data["belts"]["lane_z2"]
    assert (z1["start"], z1["length"], z1["speed"], z1["material"]) == ([0.0, -0.1], 0.5, 0.4, "chain")
    assert (z2["start"], z2["length"], z2["speed"], z2["material"]) == ([0.5, -0.1], 1.5, 0.6, "rubber")
    assert expansion.plan is not None
    plan = expansion.plan.conveyors["lane"]
    assert [plan.belt_at(s) for s in (0.0, 0.49, 0.5, 2.0)] == ["lane_z1", "lane_z1", "lane_z2", "lane_z2"]
    assert expansion.sources["belts", "lane_z2", "speed"] == ("conveyors", "lane", "sections", 1, "speed")
    assert expansion.sources["belts", "lane_z1", "speed"] == ("conveyors", "lane", "speed")


@pytest.mark.parametrize(
    ("drive", "section", "fields"),
    [
        ({"drive": "m1", "ratio": 2.0}, {}, {"drive": "m1", "ratio": 2.0}),
        ({"drive": "m1", "ratio": 2.0}, {"ratio": 1.5}, {"drive": "m1", "ratio": 1.5}),
        ({"drive": "m1", "ratio": 2.0}, {"drive": "m2"}, {"drive": "m2"}),
        ({"drive": "m1", "ratio": 2.0}, {"speed": 0.5}, {"speed": 0.5}),
        ({"speed": 0.4, "watchdog": 1.0}, {"drive": "m2"}, {"drive": "m2"}),
        ({"speed": 0.4, "watchdog": 1.0}, {"speed": 0.5}, {"speed": 0.5, "watchdog": 1.0}),
    ],
)
def test_a_section_takes_from_the_conveyor_what_fits_its_own_drive(drive: Data, section: Data, fields: Data) -> None:
    base = {name: value for name, value in conveyor().items() if name != "speed"}
    sections = [{"name": "z1", "to": 0.5}, {"name": "z2", **section}]
    belt = belts(lane={**base, **drive, "sections": sections})["lane_z2"]
    assert {name: belt[name] for name in ("drive", "ratio", "speed", "watchdog") if name in belt} == fields


def test_order_follows_the_file() -> None:
    belt = {"kind": "straight", "start": [9, 9], "angle": 0, "length": 1, "width": 1, "material": "chain"}
    guides = {"g": {"along": "b", "clearance": 0.1, "material": "steel"}}
    conveyors = {"b": conveyor(after="a"), "a": conveyor(guides={"clearance": 0.1, "material": "steel"})}
    first = expanded(belts={"z": belt}, conveyors=conveyors, guides=guides).data
    assert list(first["belts"]) == ["z", "b", "a"]
    assert list(first["rails"]) == ["a_left", "a_right", "g_left", "g_right"]
    last = expanded(guides=guides, conveyors=conveyors, belts={"z": belt}).data
    assert list(last["belts"]) == ["b", "a", "z"]
    assert list(last["rails"]) == ["g_left", "g_right", "a_left", "a_right"]


def test_data_without_a_layout_stay_the_same_object() -> None:
    data: Data = {"name": "old", "belts": {}}
    assert expand(data).data is data


def test_a_loop_with_guides_closes() -> None:
    half = [{"straight": 1.0}, {"left": math.radians(180), "radius": 0.5}]
    guides = {"clearance": 0.1, "material": "steel"}
    scene = read(conveyors={"loop": conveyor(path=half * 2, guides=guides)})
    for side in ("left", "right"):
        pieces = [shape for shape in rail_shapes(scene) if f"_{side}_" in shape.name]
        ends = [ends_along(shape) for shape in pieces]
        for (_, end), (start, _) in zip(ends, ends[1:] + ends[:1], strict=True):
            assert math.dist(end, start) < 1e-12


def ends_along(shape: RailShape) -> tuple[tuple[float, float], tuple[float, float]]:
    (piece,) = shape.pieces
    assert isinstance(piece, (ArcPiece, SegmentPiece))
    return piece.ends


def test_points_with_a_radius_pass_their_corners() -> None:
    plan = expanded(conveyors={"lane": conveyor(points=[[0, 0], [2, 0], [2, 3]], radius=0.5)}).plan
    assert plan is not None
    route = plan.conveyors["lane"].route
    assert [piece.end.xy for piece in route.pieces] == [(1.5, 0.0), (2.0, 0.5), (2.0, 3.0)]

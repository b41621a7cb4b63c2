# SPDX-License-Identifier: Apache-2.0
"""Markers that RViz2 and Foxglove can draw."""

from typing import Any

import numpy as np
import pytest
import scenes
from bag.hand_made import HEADER, bottles
from bag.ros_decode import assert_same, deserialize
from physics.test_surfaces import route

from conveyor_sim.bag.messages.encode import MARKERS
from conveyor_sim.bag.messages.markers import ADD, DELETEALL, LINE_STRIP, TRIANGLE_LIST, bottles_markers, plant_markers
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.scene import Scene, belt_shapes, rail_shapes, surface_shapes
from conveyor_sim.scene.geometry import RailShape, SegmentPiece
from conveyor_sim.scene.parts.device_part import Mark

RADII = np.array([0.03, 0.05, 0.04, 0.06])


def decode(data: bytes) -> list[Any]:
    """Return the markers as rosbags reads them; ROS must read the same.

    The first marker deletes earlier ones, because a viewer outlives scenes. RViz refuses a DELETEALL anywhere else.
    """
    message: Any = typestore().deserialize_cdr(data, MARKERS)
    assert_same(deserialize(MARKERS, data), message)
    clear, *markers = message.markers
    assert (clear.action, clear.ns) == (DELETEALL, "")
    assert all(marker.action == ADD for marker in markers)
    return markers


@pytest.mark.parametrize("count", [0, 1, 2, 3, 1000])
def test_bottles_are_one_list_of_spheres_a_type(count: int) -> None:
    columns = bottles(count)
    markers = decode(bottles_markers(columns, RADII, (), HEADER))
    assert [marker.id for marker in markers] == [index for index in range(4) if (columns.type == index).any()]
    for marker in markers:
        index = marker.id
        chosen = columns.type == index
        assert [point.x for point in marker.points] == columns.x[chosen].tolist()
        assert [point.y for point in marker.points] == columns.y[chosen].tolist()
        assert marker.scale.x == marker.scale.y == 2.0 * RADII[index]
        assert marker.header.frame_id == "hall"


def test_rails_that_move_are_drawn_with_the_bottles() -> None:
    rail = RailShape("gates/g", "steel", (SegmentPiece((1.0, 2.0), (3.0, 5.0)),))
    *others, marker = decode(bottles_markers(bottles(3), RADII, [rail], HEADER))
    assert (len(others), marker.ns, marker.type) == (3, "moving_rails", LINE_STRIP)
    assert [(point.x, point.y) for point in marker.points] == [(1.0, 2.0), (3.0, 5.0)]


def test_plant_shows_every_belt_rail_and_name(scene: Scene) -> None:
    belts, rails = belt_shapes(scene), rail_shapes(scene)
    markers = decode(plant_markers(belts, rails, (), HEADER))
    by_space: dict[str, list[Any]] = {}
    for marker in markers:
        by_space.setdefault(marker.ns, []).append(marker)
    assert len(by_space["belts"]) == len(belts)
    assert len(by_space["rails"]) == len(rails)
    assert [marker.text for marker in by_space["names"]] == ["straight", "turn"]
    assert len({(marker.ns, marker.id) for marker in markers}) == len(markers)


def test_belt_surface_has_the_belts_area(scene: Scene) -> None:
    markers = decode(plant_markers(belt_shapes(scene), rail_shapes(scene), (), HEADER))
    surfaces = [marker for marker in markers if marker.type == TRIANGLE_LIST]
    quarter_ring = np.pi / 4 * (0.7**2 - 0.3**2)
    for surface, area in zip(surfaces, [0.4, quarter_ring], strict=True):
        corners = np.array([(point.x, point.y) for point in surface.points]).reshape(-1, 3, 2)
        one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        signed = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
        assert (signed > 0.0).all()  # every triangle faces up
        assert signed.sum() == pytest.approx(area, rel=2e-3)


def test_arrows_point_along_positive_speed(scene: Scene) -> None:
    markers = decode(plant_markers(belt_shapes(scene), rail_shapes(scene), (), HEADER))
    arrows = [marker for marker in markers if marker.ns == "directions"]
    for arrow in arrows:
        tail, tip = arrow.points
        if tail.x < 0.99:  # on the straight belt
            assert tip.x > tail.x
            assert tip.y == pytest.approx(tail.y)
        else:  # on the turn, which runs counter-clockwise from -90 to 0 degrees
            assert tip.y > tail.y


def test_surfaces_of_a_path_belt_share_a_name_and_plates_have_no_arrow() -> None:
    """Clockwise travel has its right edge inside; every triangle still faces up."""
    line = scenes.scene(**route(as_path=True))
    markers = decode(plant_markers(surface_shapes(line), (), (), HEADER))
    assert [marker.text for marker in markers if marker.ns == "names"] == ["line", "beside"]
    surfaces = [marker for marker in markers if marker.type == TRIANGLE_LIST]
    assert len(surfaces) == 5
    for surface in surfaces:
        corners = np.array([(point.x, point.y) for point in surface.points]).reshape(-1, 3, 2)
        one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        assert (one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0]).all()
    arrows = [[(point.x, point.y) for point in marker.points] for marker in markers if marker.ns == "directions"]
    assert all(tip[1] > -0.9 for _, tip in arrows)
    on_bend = [(tail, tip) for tail, tip in arrows if tail[0] > 0.5 and tail[1] > -0.5 and tail[1] < 0.5]
    assert on_bend and all(tip[0] > tail[0] and tip[1] < tail[1] for tail, tip in on_bend)


def test_sensors_are_lines_with_names() -> None:
    """A zone goes back to where it began."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    shapes = [Mark("beam", "photo_eye", "entry", corners[:2]), Mark("region", "zone", "waiting", corners)]
    markers = decode(plant_markers([], [], shapes, HEADER))
    assert [marker.ns for marker in markers] == ["photo_eyes", "photo_eye_names", "zones", "zone_names"]
    assert [marker.text for marker in markers] == ["", "entry", "", "waiting"]
    lines = [[(point.x, point.y) for point in marker.points] for marker in markers[::2]]
    assert lines == [[(0.0, 0.0), (1.0, 0.0)], [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)]]


def test_entries_are_triangles_and_exits_closed_outlines() -> None:
    """An entry's tip is where bottles appear; it points where they go."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    shapes = [
        Mark("entry", "source", "filler", np.array([[2.0, 3.0]]), np.pi / 2.0),
        Mark("exit", "sink", "end", corners),
    ]
    markers = decode(plant_markers([], [], shapes, HEADER))
    assert [marker.ns for marker in markers] == ["sources", "source_names", "sinks", "sink_names"]
    tip, left, right, again = [(point.x, point.y) for point in markers[0].points]
    assert tip == again == (2.0, 3.0)
    assert (left[1], right[1]) == pytest.approx((2.9, 2.9))
    assert left[0] < 2.0 < right[0]
    assert [(point.x, point.y) for point in markers[2].points] == [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)]

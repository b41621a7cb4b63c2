# SPDX-License-Identifier: Apache-2.0
"""Shapes of belts and rails: centres from two points, sectors that wrap, outlines, distances."""

import math

import numpy as np
import pytest
from facts import stating

from conveyor_sim.scene import belt_shapes, initial_bottles, parse_scene, rail_shapes
from conveyor_sim.scene.geometry import ArcPiece, BeltShape, SegmentPiece, arc_centre
from conveyor_sim.scene.schema import Scene

HEAD = """
name: shapes
duration: 1
contacts: [{between: [glass, glass], stiffness: 1}, {between: [glass, steel], stiffness: 1}]
base: [{between: [glass, rubber], friction: 0.4}]
bottle_types: {jar: {radius: 0.05, mass: 0.2, material: glass}}
"""
DIRECTIONS = [pytest.param(math.radians(degrees), id=f"{degrees} deg") for degrees in range(-180, 181, 15)]


def scene(text: str) -> Scene:
    return parse_scene(HEAD + text)


def bend(start: tuple[float, float], end: tuple[float, float], radius: float, side: str, rails: str = "") -> Scene:
    places = f"from: [{start[0]!r}, {start[1]!r}], to: [{end[0]!r}, {end[1]!r}], side: {side}"
    return scene(
        f"belts: {{bend: {{kind: curved, {places}, inner_radius: {radius!r}, width: 0.2, material: rubber{rails}}}}}\n"
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_centre_is_a_radius_from_both_points_and_on_the_asked_side(direction: float, side: str) -> None:
    p1 = (0.3, -0.7)
    p2 = (p1[0] + 0.8 * math.cos(direction), p1[1] + 0.8 * math.sin(direction))
    centre = arc_centre(p1, p2, 0.5, side)
    assert math.dist(centre, p1) == pytest.approx(0.5, abs=1e-15)
    assert math.dist(centre, p2) == pytest.approx(0.5, abs=1e-15)
    to_the_left = (p2[0] - p1[0]) * (centre[1] - p1[1]) - (p2[1] - p1[1]) * (centre[0] - p1[0])
    assert (to_the_left > 0) == (side == "left")


@pytest.mark.parametrize(
    ("p2", "side", "expected"),
    [
        ((6.0, 0.0), "left", (3.0, 4.0)),  # horizontal chords: the paper's form divides by zero
        ((6.0, 0.0), "right", (3.0, -4.0)),
        ((-6.0, 0.0), "left", (-3.0, -4.0)),
        ((-6.0, 0.0), "right", (-3.0, 4.0)),
        ((0.0, 6.0), "left", (-4.0, 3.0)),
        ((0.0, 6.0), "right", (4.0, 3.0)),
        ((0.0, -6.0), "left", (4.0, -3.0)),
        ((0.0, -6.0), "right", (-4.0, -3.0)),
    ],
)
def test_centre_of_horizontal_and_vertical_chords_is_exact(
    p2: tuple[float, float], side: str, expected: tuple[float, float]
) -> None:
    assert arc_centre((0.0, 0.0), p2, 5.0, side) == expected


def test_centre_of_a_half_circle_is_the_midpoint() -> None:
    assert arc_centre((0.0, 0.0), (2.0, 0.0), 1.0, "left") == (1.0, 0.0)


def test_half_chord_longer_than_the_radius_by_rounding_only_is_a_half_circle() -> None:
    centre = arc_centre((0.1, 0.0), (0.8, 0.0), 0.35, "left")
    assert 0.8 - 0.1 > 2 * 0.35
    assert centre == pytest.approx((0.45, 0.0))


def test_centre_that_can_not_be() -> None:
    with pytest.raises(ValueError, match=stating("radius 0.9 m", "half the chord", "1 m")):
        arc_centre((0.0, 0.0), (2.0, 0.0), 0.9, "left")
    with pytest.raises(ValueError, match="coincide"):
        arc_centre((1.0, 1.0), (1.0, 1.0), 0.9, "left")


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_bend_from_two_points_is_the_shorter_arc_and_ends_on_both(direction: float, side: str) -> None:
    start = (0.3, -0.7)
    end = (start[0] + 0.8 * math.cos(direction), start[1] + 0.8 * math.sin(direction))
    made = bend(start, end, 0.5, side, ", rails: {inner: true, material: steel}")
    (shape,) = belt_shapes(made)
    assert shape.span == pytest.approx(2 * math.asin(0.8), abs=1e-12)
    (rail,) = rail_shapes(made)
    first, last = rail.pieces[0].ends
    # Positive speed is counter-clockwise, so a bend to the right runs from its `to` to its `from`.
    assert (first, last) == (
        (pytest.approx(start, abs=1e-14), pytest.approx(end, abs=1e-14))
        if side == "left"
        else (pytest.approx(end, abs=1e-14), pytest.approx(start, abs=1e-14))
    )


def test_bend_by_centre_and_by_two_points_is_the_same() -> None:
    (by_points,) = belt_shapes(bend((2.0, 0.0), (3.0, 1.0), 1.0, "left"))
    (by_centre,) = belt_shapes(
        scene(
            "belts: {bend: {kind: curved, centre: [2, 1], start_angle: -90 deg, span: 90 deg, inner_radius: 1, "
            "width: 0.2, material: rubber}}\n"
        )
    )
    assert by_points.centre == pytest.approx(by_centre.centre, abs=1e-15)
    assert (by_points.start_angle, by_points.span) == pytest.approx((by_centre.start_angle, by_centre.span), abs=1e-14)


def area(outline: np.ndarray) -> float:
    x, y = outline.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def test_straight_belt_begins_at_its_right_hand_corner_and_grows_to_the_left() -> None:
    shape = BeltShape("b", "straight", 0.5, corner=(1.0, 2.0), angle=math.pi / 2, length=3.0)
    np.testing.assert_allclose(shape.outline(), [[1, 2], [1, 5], [0.5, 5], [0.5, 2]], atol=1e-15)
    np.testing.assert_allclose(shape.centre_line(3), [[0.75, 2], [0.75, 3.5], [0.75, 5]], atol=1e-15)


@pytest.mark.parametrize("start_angle", [-math.pi, -math.pi / 2, 0.0, 3.0, 3.2, 6.0])
@pytest.mark.parametrize("span", [0.5, math.pi, 5.0, 2 * math.pi])
@pytest.mark.parametrize("inner_radius", [0.0, 1.0])
def test_outline_of_a_sector_has_its_area_also_across_plus_minus_pi(
    start_angle: float, span: float, inner_radius: float
) -> None:
    shape = BeltShape(
        "b", "curved", 0.5, centre=(3.0, 4.0), inner_radius=inner_radius, start_angle=start_angle, span=span
    )
    outline = shape.outline(2001)
    assert area(outline) == pytest.approx(span / 2 * ((inner_radius + 0.5) ** 2 - inner_radius**2), rel=1e-5)
    seen = outline - [3.0, 4.0]
    far = seen[np.hypot(*seen.T) > 1e-9]
    turned = np.mod(np.arctan2(far[:, 1], far[:, 0]) - start_angle + 1e-9, 2 * math.pi)
    assert turned.max() <= span + 2e-9


def test_centre_line_of_a_sector_runs_counter_clockwise_across_pi() -> None:
    shape = BeltShape("b", "curved", 0.5, inner_radius=1.0, start_angle=math.radians(170), span=math.radians(20))
    line = shape.centre_line(3)
    np.testing.assert_allclose(np.hypot(*line.T), 1.25)
    np.testing.assert_allclose(line[1], [-1.25, 0.0], atol=1e-15)
    assert line[0, 1] > 0 > line[2, 1]


def test_disc_outline_has_no_point_twice() -> None:
    outline = BeltShape("b", "curved", 1.0, inner_radius=0.0, start_angle=0.0, span=2 * math.pi).outline(9)
    assert len(outline) == 8
    assert np.hypot(*(outline - np.roll(outline, 1, axis=0)).T).min() > 0.5


def test_rails_are_listed_in_order_then_those_of_curved_belts() -> None:
    made = scene(
        """
rails:
  z: {kind: segment, from: [0, 0], to: [1, 0], material: steel}
  a: {kind: polyline, points: [[0, 1], [1, 1], [1, 2]], closed: true, material: steel}
  arc: {kind: arc, centre: [9, 9], radius: 1, start_angle: 170 deg, span: 20 deg, material: steel}
belts:
  one: {kind: curved, centre: [4, 4], start_angle: 0, span: 1, inner_radius: 1, width: 0.5, material: rubber,
        rails: {inner: true, outer: true, material: steel}}
  two: {kind: curved, centre: [4, 4], start_angle: 2, span: 1, inner_radius: 1, width: 0.5, material: rubber}
  three: {kind: curved, centre: [4, 4], start_angle: 4, span: 1, inner_radius: 1, width: 0.5, material: rubber,
        rails: {outer: true, material: steel}}
"""
    )
    shapes = rail_shapes(made)
    assert [shape.name for shape in shapes] == ["z", "a", "arc", "one_inner", "one_outer", "three_outer"]
    assert [len(shape.pieces) for shape in shapes] == [1, 3, 1, 1, 1, 1]
    np.testing.assert_array_equal(shapes[1].outline(), [[0, 1], [1, 1], [1, 2], [0, 1]])
    assert len(shapes[2].outline(5)) == 5
    assert shapes[4].pieces == (ArcPiece((4.0, 4.0), 1.5, 0.0, 1.0),)


def test_distance_from_a_segment_counts_its_end_points() -> None:
    piece = SegmentPiece((0.0, 0.0), (2.0, 0.0))
    points = np.array([[1.0, 0.5], [-3.0, 4.0], [5.0, -4.0], [1.0, 0.0]])
    np.testing.assert_allclose(piece.distance(points), [0.5, 5.0, 5.0, 0.0])


def test_distance_from_an_arc_counts_its_end_points_and_wraps() -> None:
    piece = ArcPiece((1.0, 1.0), 2.0, math.radians(135), math.radians(90))  # from upper left through pi to lower left
    points = np.array([[-2.0, 1.0], [0.0, 1.0], [1.0, 1.0], [3.0, 1.0]])
    end = 1 + 2 * np.array([math.cos(math.radians(135)), math.sin(math.radians(135))])
    np.testing.assert_allclose(piece.distance(points), [1.0, 1.0, 2.0, math.dist(end, (3.0, 1.0))])
    np.testing.assert_allclose(piece.distance(piece.points(7)), 0.0, atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_distances_are_those_to_the_nearest_of_many_points(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.uniform(-3, 3, (50, 2))
    arc = ArcPiece((0.3, -0.2), 1.3, random.uniform(-7, 7), random.uniform(0.1, 2 * math.pi))
    line = SegmentPiece((-1.0, 0.4), (1.5, -0.7))
    for piece, dense in ((arc, arc.points(8001)), (line, np.linspace(line.p1, line.p2, 4001))):
        nearest = np.hypot(*(points[:, None] - dense[None]).transpose(2, 0, 1)).min(axis=1)
        np.testing.assert_allclose(piece.distance(points), nearest, atol=1e-3)


def test_bottles_at_the_start_come_in_order_with_grids_row_by_row() -> None:
    made = scene(
        """
bottles:
  - {type: jar, position: [9, 9], velocity: [1, 2], angle: 90 deg, spin: 3}
  - grid: {type: jar, origin: [0, 0], rows: 2, columns: 2, pitch: 0.2}
  - grid: {type: jar, origin: [5, 5], rows: 3, columns: 2, pitch: 0.2, pattern: hexagonal, angle: 90 deg}
"""
    )
    bottles = initial_bottles(made)
    assert bottles[0] == ("jar", 9.0, 9.0, math.pi / 2, 1.0, 2.0, 3.0)
    np.testing.assert_allclose([b[1:3] for b in bottles[1:5]], [[0, 0], [0.2, 0], [0, 0.2], [0.2, 0.2]])
    high = 0.1 * math.sqrt(3)
    expected = [[5, 5], [5, 5.2], [5 - high, 5.1], [5 - high, 5.3], [5 - 2 * high, 5], [5 - 2 * high, 5.2]]
    np.testing.assert_allclose([b[1:3] for b in bottles[5:]], expected)
    assert all(b[3:] == (0.0, 0.0, 0.0, 0.0) for b in bottles[1:])

# SPDX-License-Identifier: Apache-2.0
"""Rails: nearest point of the piece, end points included; joined pieces push once; no contact beyond an end."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenes import RADIUS, arc, polyline, segment
from worlds import (
    ALONE,
    STIFFNESS,
    callable_part,
    nearest_of,
    nearest_on_arc,
    nearest_on_segment,
    push,
    rail_forces,
    rail_scene,
)

from conveyor_sim.engine.rails.deepest_contacts import keep_deepest as keep_deepest_part
from conveyor_sim.engine.threads.workers import MOST_CONTACTS
from conveyor_sim.physics.model import build_model

keep_deepest = callable_part(keep_deepest_part)

RANDOM = np.random.default_rng(20240229)
ROUNDING = 1e-9
"""Rounding error, N, of forces of up to 65 N whose overlap is a difference of coordinates of some metres."""


def around(low: tuple[float, float], high: tuple[float, float], count: int = 3000) -> np.ndarray:
    """Return points all over a box."""
    return RANDOM.uniform(low, high, (count, 2))


def test_a_segment_pushes_from_its_nearest_point() -> None:
    start, end = (-0.3, 0.1), (0.4, 0.35)
    points = around((-0.5, -0.1), (0.6, 0.6))
    expected = push(nearest_on_segment(start, end, points), points)
    np.testing.assert_allclose(rail_forces({"rail": segment(start, end)}, points), expected, atol=ROUNDING)


def test_there_is_no_ghost_past_an_end() -> None:
    """On the infinite line through a segment, beyond its end by more than R, the paper's distance would push."""
    beyond = np.array([[1.0 + RADIUS + 1e-12, 0.0], [1.2, 0.01], [-RADIUS - 1e-12, 1e-9], [1.0 + RADIUS, 0.03]])
    assert not rail_forces({"rail": segment((0.0, 0.0), (1.0, 0.0))}, beyond).any()
    around_arc = np.array([[0.5 * math.cos(a), 0.5 * math.sin(a)] for a in (-0.14, 1.14, 3.0)])
    assert not rail_forces({"rail": arc((0.0, 0.0), 0.5, 0.0, 1.0)}, around_arc).any()


@pytest.mark.parametrize("start", [-3.0, 0.7, 2.9])
@pytest.mark.parametrize("span", [0.4, math.pi, 4.0, 2.0 * math.pi - 0.3, 2.0 * math.pi])
@pytest.mark.parametrize("radius", [0.05, 0.5])
def test_an_arc_pushes_from_its_nearest_point(start: float, span: float, radius: float) -> None:
    """From inside and outside, with spans across +-pi, over half a turn and full; radii below the bottle's, too."""
    centre = (0.2, -0.1)
    reach = radius + 1.5 * RADIUS
    points = around((centre[0] - reach, centre[1] - reach), (centre[0] + reach, centre[1] + reach))
    points = points[~touches_twice(centre, radius, start, span, points)]
    expected = push(nearest_on_arc(centre, radius, start, span, points), points)
    forces = rail_forces({"rail": arc(centre, radius, start, span)}, points)
    np.testing.assert_allclose(forces, expected, atol=ROUNDING)


def touches_twice(centre: tuple[float, float], radius: float, start: float, span: float, points: np.ndarray) -> Any:
    """Return True if a bottle at a point touches an open arc at a tip and at another nearest place."""
    places = []
    for angle, inward in ((start, 1.0), (start + span, -1.0)):
        away = np.array(centre) + radius * np.array([math.cos(angle), math.sin(angle)]) - points
        nearest = away @ [-inward * math.sin(angle), inward * math.cos(angle)] > 0.0
        places.append(nearest & (np.hypot(*away.T) < RADIUS))
    seen = points - np.array(centre)
    within = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - start, 2.0 * math.pi) < span
    places.append(within & (np.abs(np.hypot(*seen.T) - radius) < RADIUS))
    return (np.sum(places, axis=0) > 1) & (span < 2.0 * math.pi)


@pytest.mark.parametrize("half", [0.4, 1.2, math.pi / 2, 2.5, 3.1])
@pytest.mark.parametrize("radius", [0.03, 0.05, 0.2])
def test_a_bottle_in_the_mouth_of_an_arc_is_pushed_straight_out(half: float, radius: float) -> None:
    """The mouth is symmetric about its middle, and both tips push, by the shortest way out if they can."""
    rails = {"c": arc((0.3, 0.1), radius, math.pi - half, 2.0 * half)}
    away = np.linspace(0.001, RADIUS, 200) + max(0.0, radius * math.cos(math.pi - half))
    forces = rail_forces(rails, np.column_stack([0.3 + away, np.full(away.size, 0.1)]))
    tip = radius * np.array([-math.cos(half), math.sin(half)])
    distance = np.hypot(away + radius * math.cos(half), tip[1])
    along = (away + radius * math.cos(half)) / distance
    overlap = np.maximum(RADIUS - distance, 0.0)
    together = np.where(along > math.sqrt(0.5), 1.0 / along, 2.0 * along)
    scale = STIFFNESS * RADIUS
    np.testing.assert_allclose(forces[:, 0], STIFFNESS * overlap * together, atol=1e-9 * scale)
    np.testing.assert_allclose(forces[:, 1], 0.0, atol=1e-9 * scale)
    assert forces.any() == (radius * (math.sin(half) if half > math.pi / 2 else 1.0) < RADIUS)

    beside = around((0.3 - radius - RADIUS, 0.1), (0.3 + radius + RADIUS, 0.1 + radius + RADIUS), 1000)
    above, below = rail_forces(rails, beside), rail_forces(rails, (beside - [0.0, 0.1]) * [1.0, -1.0] + [0.0, 0.1])
    np.testing.assert_allclose(above, below * [1.0, -1.0], atol=1e-9 * scale)


@pytest.mark.parametrize(("opening", "most"), [((0.2, 0.75), 0.05), ((0.75, 3.1), 0.25)])
def test_many_pieces_at_once_push_sideways_by_no_more(opening: tuple[float, float], most: float) -> None:
    """A polyline along a C pushes a bottle on its axis of symmetry along it, except for a share of its deepest push.

    Three or more pieces share their push by sweeps in their order, which may end early if they face each other.
    """
    random = np.random.default_rng(3)
    points = np.column_stack([np.linspace(-0.3, 0.3, 120), np.zeros(120)])
    for _ in range(25):
        radius, half, count = random.uniform(0.02, 0.2), random.uniform(*opening), int(random.integers(4, 40))
        angles = np.linspace(math.pi - half, math.pi + half, count)
        corners = radius * np.column_stack([np.cos(angles), np.sin(angles)])
        forces = rail_forces({"c": polyline(corners)}, points)
        sides = [np.hypot(*(nearest_on_segment(*ends, points) - points).T) for ends in pairwise(corners)]
        nearest = np.min(sides, axis=0)
        overlap = np.maximum(RADIUS - nearest, 0.0)
        held = overlap < 0.75 * RADIUS  # the guard stops deeper overlaps
        assert (np.abs(forces[held, 1]) <= most * STIFFNESS * overlap[held] + ROUNDING).all()


def test_wider_mouths_and_joined_ends_leave_an_arc_whole() -> None:
    wide = arc((0.0, 0.0), 0.5, 0.2, 5.8)
    narrow = arc((0.0, 0.0), 0.05, 0.0, 4.0)
    closed = arc((0.0, 0.0), 0.05, 0.0, 2.0 * math.pi)
    fillet = {"arc": arc((0.0, 0.0), 0.05, 0.0, math.pi / 2), "a": segment((0.05, 0.0), (0.05, -1.0)),
              "b": segment((0.0, 0.05), (-1.0, 0.05))}  # fmt: skip
    for rails, pieces in (({"a": wide}, 1), ({"a": narrow}, 2), ({"a": closed}, 1), (fillet, 3)):
        model = build_model(rail_scene(rails))
        assert sum(len(shape.pieces) for shape in model.plant.rails) == pieces


def test_collinear_pieces_push_as_one_segment() -> None:
    """The result does not depend on the cuts of a straight rail or the order of its pieces."""
    start, end = np.array([-0.4, -0.2]), np.array([0.5, 0.3])
    points = around((-0.6, -0.4), (0.7, 0.5))
    whole = rail_forces({"rail": segment(tuple(start), tuple(end))}, points)
    shares = np.sort(RANDOM.uniform(0.0, 1.0, 30))
    corners = start + np.concatenate([[0.0], shares, [1.0]])[:, None] * (end - start)
    np.testing.assert_allclose(rail_forces({"rail": polyline(corners)}, points), whole, atol=ROUNDING)
    order = RANDOM.permutation(len(corners) - 1)
    loose = {
        f"r{n}": segment(*(tuple(corners[i + side]) for side in ((0, 1) if n % 2 else (1, 0))))
        for n, i in enumerate(order)
    }
    np.testing.assert_allclose(rail_forces(loose, points), whole, atol=ROUNDING)


def test_a_rail_given_twice_pushes_once() -> None:
    """Rounding makes the cosine between its normals slightly less than 1, or not, by direction."""
    points = around((-0.5, -0.5), (0.5, 0.5), 300)
    for angle in np.linspace(0.0, 2.0 * math.pi, 40):
        way = 0.4 * np.array([math.cos(angle), math.sin(angle)])
        once = {"a": segment(tuple(-way), tuple(way))}
        twice = rail_forces({**once, "b": segment(tuple(-way), tuple(way * (1.0 + 1e-15)))}, points)
        np.testing.assert_allclose(twice, rail_forces(once, points), atol=ROUNDING)


@pytest.mark.parametrize("turn", [0.02, 0.5, math.pi / 2, 2.5])
def test_a_convex_corner_pushes_once(turn: float) -> None:
    """Outside of a corner the force is that of the nearest point of both pieces, also in the fan at the corner."""
    first, corner, last = (-1.0, 0.0), (0.0, 0.0), (math.cos(turn), -math.sin(turn))
    points = around((-0.3, -0.3), (0.3, 0.3))
    # Above both lines, or between their normals at the corner.
    outside = (points[:, 1] > 0.0) & (points @ [math.sin(turn), math.cos(turn)] > 0.0)
    points = points[outside]
    both = [nearest_on_segment(first, corner, points), nearest_on_segment(corner, last, points)]
    expected = push(nearest_of(both, points), points)
    np.testing.assert_allclose(rail_forces({"r": polyline([first, corner, last])}, points), expected, atol=ROUNDING)
    two_rails = {"a": segment(corner, first), "b": segment(corner, last)}
    np.testing.assert_allclose(rail_forces(two_rails, points), expected, atol=ROUNDING)


def test_a_concave_right_angle_is_two_walls() -> None:
    points = around((0.01, 0.01), (0.3, 0.3))
    walls = [nearest_on_segment((0, 0), (1, 0), points), nearest_on_segment((0, 0), (0, 1), points)]
    expected = sum(push(wall, points) for wall in walls)
    forces = rail_forces({"corner": polyline([(1, 0), (0, 0), (0, 1)])}, points)
    np.testing.assert_allclose(forces, expected, atol=ROUNDING)


@pytest.mark.parametrize("inside", [0.2, 0.5, 1.0, 1.5])
def test_an_acute_wedge_is_two_walls(inside: float) -> None:
    """Walls at an angle of less than 90 degrees push independently."""
    wall_a, wall_b = (1.0, 0.0), (math.cos(inside), math.sin(inside))
    along = RANDOM.uniform(0.05, 0.9, 2000)
    within = RANDOM.uniform(0.05, 0.95, 2000) * inside
    points = np.column_stack([along * np.cos(within), along * np.sin(within)])
    # Both nearest points are on the pieces, none at the tip.
    expected = sum(push(nearest_on_segment((0, 0), wall, points), points) for wall in (wall_a, wall_b))
    forces = rail_forces({"wedge": polyline([wall_a, (0, 0), wall_b])}, points)
    np.testing.assert_allclose(forces, expected, atol=ROUNDING)


@pytest.mark.parametrize("turn", [1e-6, 1e-3, 0.03, 0.2, 1.0, 1.5])
def test_a_shallow_concave_corner_neither_jumps_nor_pushes_twice(turn: float) -> None:
    """A bottle slides 5 mm deep along a wall, then along another that rises by `turn`: (x, h), then its mirror image.

    The push grows from k delta to that of the shortest way out in the corner, k delta / cos(turn / 2), and no faster
    than k per metre. Rounding of the cosine between the walls is divided by its distance from 1.
    """
    rounding = 1e-9 + 4e-16 / turn**2
    depth, count = 0.005, 4000
    height = RADIUS - depth
    before = np.column_stack([np.linspace(-0.2, -height * math.tan(turn / 2.0), count), np.full(count, height)])
    turned = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    path = np.concatenate([before, (before * [-1.0, 1.0])[::-1] @ turned])
    forces = rail_forces({"r": polyline([(-1, 0), (0, 0), (math.cos(turn), math.sin(turn))])}, path)
    size = np.hypot(*forces.T)
    np.testing.assert_allclose(size.min(), STIFFNESS * depth, rtol=1e-9)
    np.testing.assert_allclose(size.max(), STIFFNESS * depth / math.cos(turn / 2.0), rtol=rounding)
    changed, moved = np.hypot(*np.diff(forces, axis=0).T), np.hypot(*np.diff(path, axis=0).T)
    assert np.all(changed <= STIFFNESS * (moved + depth * rounding))


def shortest_way_out(normals: np.ndarray, overlaps: np.ndarray) -> np.ndarray:
    """Return the shortest d with n . d >= overlap for all, by trial over all pairs of active walls."""
    best = None
    count = len(overlaps)
    for a in range(count):
        for b in range(a, count):
            d = overlaps[a] * normals[a] if a == b else np.linalg.solve(normals[[a, b]], overlaps[[a, b]])
            if np.all(normals @ d >= overlaps - 1e-12) and (best is None or d @ d < best @ best):
                best = d
    assert best is not None
    return best


@pytest.mark.parametrize("turns", [(0.5, 0.5), (0.2, 0.9), (0.05, 0.02), (0.4, 0.3, 0.5)])
def test_several_pieces_at_once_push_by_the_shortest_way_out(turns: tuple[float, ...]) -> None:
    """A concave chain of pieces so short that a bottle touches up to four of them."""
    heading = -sum(turns) / 2.0 + np.concatenate([[0.0], np.cumsum(turns)])
    pieces = np.column_stack([np.cos(heading), np.sin(heading)]) * 0.02
    pieces[[0, -1]] *= 20.0
    corners = np.concatenate([[[0.0, 0.0]], np.cumsum(pieces, axis=0)])
    corners -= corners[1:-1].mean(axis=0)
    points = around((-0.05, RADIUS - 0.03), (0.05, RADIUS + 0.01), 1000)
    forces = rail_forces({"r": polyline(corners)}, points)
    most = 0
    for point, force in zip(points, forces, strict=True):
        touching, depth = [], []
        for start, end in pairwise(corners):
            along = (end - start) / np.hypot(*(end - start))
            normal = np.array([-along[1], along[0]])
            overlap = RADIUS - (point - start) @ normal
            if 0.0 < (point - start) @ along < np.hypot(*(end - start)) and overlap > 0.0:
                touching.append(normal)
                depth.append(overlap)
        most = max(most, len(depth))
        expected = shortest_way_out(np.array(touching), np.array(depth)) if touching else np.zeros(2)
        # Projected Gauss-Seidel ends after 64 sweeps.
        np.testing.assert_allclose(force / STIFFNESS, expected, atol=1e-6 if len(depth) > 2 else 1e-9)
    assert most >= 2


def test_an_arc_and_a_segment_that_join_smoothly_push_as_one() -> None:
    """A stadium's half (straight, half circle, straight) pushes from its nearest point, from inside and outside."""
    rails = {
        "top": segment((-1.0, 0.3), (0.0, 0.3)),
        "bend": arc((0.0, 0.0), 0.3, -math.pi / 2, math.pi),
        "bottom": segment((0.0, -0.3), (-1.0, -0.3)),
    }
    points = around((-0.3, -0.5), (0.5, 0.5))
    expected = push(
        nearest_of(
            [
                nearest_on_segment((-1.0, 0.3), (0.0, 0.3), points),
                nearest_on_arc((0.0, 0.0), 0.3, -math.pi / 2, math.pi, points),
                nearest_on_segment((0.0, -0.3), (-1.0, -0.3), points),
            ],
            points,
        ),
        points,
    )
    np.testing.assert_allclose(rail_forces(rails, points), expected, atol=ROUNDING)


@pytest.mark.parametrize("arms", [3, 5])
def test_pieces_that_meet_at_a_point_push_once_from_it(arms: int) -> None:
    """If the nearest point of a star is its middle or on one arm alone, the push is that of one contact."""
    angles = 0.3 + np.array([0.0, 0.5, 1.0, 1.4, 1.7])[:arms]
    tips = np.column_stack([np.cos(angles), np.sin(angles)])
    points = around((-0.2, -0.2), (0.2, 0.2))
    # Behind all arms.
    behind = points[np.all(points @ tips.T < 0.0, axis=1)]
    forces = rail_forces({f"arm{i}": segment((0, 0), tuple(tip)) for i, tip in enumerate(tips)}, behind)
    np.testing.assert_allclose(forces, push(np.zeros((len(behind), 2)), behind), atol=ROUNDING)


@pytest.mark.parametrize("stem", [(0.0, -1.0), (0.4, -1.0)])
def test_a_rail_is_smooth_opposite_a_t_junction(stem: tuple[float, float]) -> None:
    """A stem that ends on a rail from below has no effect above (at overlaps of less than half the radius)."""
    rails = {"through": segment((-1.0, 0.0), (1.0, 0.0)), "stem": segment((0.0, 0.0), stem)}
    points = around((-0.2, 0.51 * RADIUS), (0.2, 0.1))
    expected = push(nearest_on_segment((-1, 0), (1, 0), points), points)
    np.testing.assert_allclose(rail_forces(rails, points), expected, atol=ROUNDING)


def test_a_stem_is_a_wall_at_a_t_junction() -> None:
    """On the stem's side both push, as in a corner."""
    rails = {"through": segment((-1.0, 0.0), (1.0, 0.0)), "stem": segment((0.0, 0.0), (0.0, -1.0))}
    points = around((0.005, -0.1), (0.1, -0.005))
    walls = [nearest_on_segment((-1, 0), (1, 0), points), nearest_on_segment((0, 0), (0, -1), points)]
    expected = sum(push(wall, points) for wall in walls)
    np.testing.assert_allclose(rail_forces(rails, points), expected, atol=ROUNDING)


def test_a_stem_that_ends_on_an_arc_is_not_felt_from_the_other_side() -> None:
    rails = {"bend": arc((0.0, 0.0), 0.5, 0.0, math.pi), "stem": segment((0.0, 0.5), (0.1, 1.0))}
    points = around((-0.2, 0.35), (0.2, 0.5))
    points = points[np.hypot(*points.T) < 0.5 - 0.55 * RADIUS]
    expected = push(nearest_on_arc((0, 0), 0.5, 0.0, math.pi, points), points)
    np.testing.assert_allclose(rail_forces(rails, points), expected, atol=ROUNDING)


def test_a_centre_exactly_on_a_rail_is_pushed_off() -> None:
    """On the piece, a joint, a free end, an arc, its ends or its centre, the push is finite, and at most k R."""
    rails = {
        "line": polyline([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 1.0)]),
        "bend": arc((5.0, 0.0), 0.05, 0.0, 1.5 * math.pi),
    }
    on_line = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (2.0, 0.0), (2.5, 0.5), (3.0, 1.0)]
    on_bend = [(5.05, 0.0), (5.0, 0.05), (5.0 + 0.05 * math.cos(1.5 * math.pi), 0.05 * math.sin(1.5 * math.pi))]
    size = np.hypot(*rail_forces(rails, on_line + on_bend + [(5.0, 0.0)]).T)
    assert np.all(np.isfinite(size))
    np.testing.assert_allclose(size[:-1], STIFFNESS * RADIUS, rtol=1e-6)
    assert 0.0 < size[-1] <= STIFFNESS * RADIUS


def test_more_contacts_than_there_is_room_for_keep_the_deepest() -> None:
    """In any order of contacts, the shallowest are left out."""
    contacts = ALONE.rail_contacts
    overlaps = np.random.default_rng(1).permutation(np.arange(1.0, MOST_CONTACTS + 9.0))
    count = 0
    for overlap in overlaps:
        count = keep_deepest(contacts, count, overlap, 1.0, 0.0, 0, int(overlap), 0, 0)
    assert count == MOST_CONTACTS
    assert sorted(contacts.overlap) == list(np.arange(9.0, MOST_CONTACTS + 9.0))
    np.testing.assert_array_equal(contacts.rail, contacts.overlap)

# SPDX-License-Identifier: Apache-2.0
"""The search by cells and boxes finds the same as a comparison of all with all."""

import numpy as np
import pytest

from conveyor_sim.scene.geometry import ArcPiece, Piece, SegmentPiece
from conveyor_sim.scene.overlaps import MOST_PAIRS, near_pieces, overlapping
from conveyor_sim.scene.polygons import why_not_simple


@pytest.mark.parametrize("seed", range(6))
def test_same_pairs_as_all_against_all(seed: int) -> None:
    random = np.random.default_rng(seed)
    centres = random.uniform(-5, 5, (400, 2)) * random.choice([1.0, 0.2, 3.0])
    radii = random.uniform(0.02, 0.3, 400)
    apart = np.hypot(*(centres[:, None] - centres[None]).transpose(2, 0, 1))
    expected = np.argwhere(np.triu(apart < radii[:, None] + radii[None] - 1e-9, 1))
    assert len(expected) > 0
    np.testing.assert_array_equal(np.column_stack(overlapping(centres, radii, 1e-9)), expected)


def test_touching_is_no_overlap() -> None:
    first, _ = overlapping(np.array([[0.0, 0.0], [0.3, 0.4]]), np.array([0.25, 0.25]), 1e-9)
    assert len(first) == 0


def test_neighbours_far_apart_along_one_axis_only() -> None:
    centres = np.array([[0.0, 0.0], [1e5, 0.0], [1e5, 0.05], [0.0, -0.05]])
    first, second = overlapping(centres, np.full(4, 0.05), 1e-9)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 3), (1, 2)]


@pytest.mark.parametrize("number", [0, 1])
def test_too_few_to_overlap(number: int) -> None:
    assert len(overlapping(np.zeros((number, 2)), np.ones(number), 0.0)[0]) == 0


@pytest.mark.parametrize("seed", range(6))
def test_points_near_pieces_are_those_of_all_against_all(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.uniform(-2, 2, (200, 2))
    points[:20, 0] = points[0, 0]  # points one above the other share their place in the order by x
    pieces: list[Piece] = [SegmentPiece((x, y), (x + dx, y + dy)) for x, y, dx, dy in random.uniform(-1, 1, (20, 4))]
    for x, y, start in random.uniform(-2, 2, (20, 3)):
        pieces.append(ArcPiece((x, y), random.uniform(0.1, 1.5), start, random.uniform(0.1, 6.28)))
    within = 0.1
    expected = {(i, k) for i, piece in enumerate(pieces) for k in np.flatnonzero(piece.distance(points) <= within)}
    assert len(expected) > 20
    found = set()
    for index, near, apart in near_pieces(points, pieces, within):
        # One point or all of them: numpy adds the two products of a dot in another order, a rounding apart.
        np.testing.assert_allclose(apart, pieces[index].distance(points)[near], rtol=0, atol=1e-14)
        assert np.all(np.diff(near) > 0)
        found |= {(index, k) for k in near[apart <= within]}
    assert found == expected


@pytest.mark.parametrize("number", [0, 3])
def test_nothing_is_near_where_there_is_nothing(number: int) -> None:
    assert not list(near_pieces(np.zeros((number, 2)), [], 1.0))
    assert not list(near_pieces(np.zeros((number, 2)), [SegmentPiece((9.0, 9.0), (9.0, 8.0))], 1.0))


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (1, 0), (0, 1)),
        ((0, 0), (0, 1), (1, 0)),
        ((0, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)),
        ((0, 0), (1, 0), (2, 0), (2, 1)),
    ],
)
def test_simple_polygons(corners: tuple[tuple[float, float], ...]) -> None:
    assert why_not_simple(corners) is None


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        (((0, 0), (1, 1), (1, 0), (0, 1)), "sides 1 and 3 meet"),
        (((0, 0), (2, 0), (2, 2), (1, 0), (0, 2)), "sides 1 and 3 meet"),  # a corner on a side
        (((0, 0), (2, 0), (1, 0), (1, 1)), "sides 1 and 2 meet"),  # a side that runs back
        (((0, 0), (0, 0), (1, 1)), "side 1 has no length"),
    ],
)
def test_polygons_that_are_not_simple(corners: tuple[tuple[float, float], ...], reason: str) -> None:
    assert why_not_simple(corners) == reason


def test_circles_at_one_place_have_no_more_pairs_than_are_looked_for() -> None:
    """20 000 have 200 million pairs, which take 10 GB."""
    count = 20_000
    first, second = overlapping(np.zeros((count, 2)), np.full(count, 0.05), 1e-9)
    assert MOST_PAIRS <= len(first) < 6 * MOST_PAIRS
    assert (first < second).all()


def test_many_neighbours_are_compared_in_parts() -> None:
    """One large circle makes cells that hold all the small ones."""
    random = np.random.default_rng(1)
    centres, radii = random.uniform(0.0, 1.0, (4000, 2)), np.full(4000, 0.002)
    centres[0], radii[0] = (5.0, 5.0), 1.0
    first, second = overlapping(centres, radii, 1e-9)
    apart = np.hypot(*(centres[:, None] - centres[None, :]).transpose(2, 0, 1))
    one, other = np.nonzero(np.triu(apart < radii[:, None] + radii[None, :] - 1e-9, 1))
    assert len(one) > 50
    assert np.array_equal(first, one) and np.array_equal(second, other)

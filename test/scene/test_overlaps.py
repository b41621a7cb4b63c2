"""Overlapping circles found through cells are those that comparing all with all finds."""

import numpy as np
import pytest

from conveyor_sim.scene.overlaps import overlapping
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

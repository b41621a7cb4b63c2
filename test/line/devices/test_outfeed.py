# SPDX-License-Identifier: Apache-2.0
"""Outfeeds: bottles whose axes are in the region leave. Their slots are used again, their ids are not."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from scenes import RADIUS, base, belt, contact, segment, simulation
from worlds import FAR

from conveyor_sim.engine.sensors.region_search import RegionSearch

STAR = np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.2], [0.3, -0.1], [0.6, -0.9], [0.0, -0.3], [-0.7, -0.8], [-0.3, 0.0],
                 [-1.0, 0.4], [-0.2, 0.3]])  # fmt: skip


def winding(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return whether the polygon winds around each point, by a method other than that of the engine."""
    a = corners[None] - points[:, None]
    b = np.roll(corners, -1, axis=0)[None] - points[:, None]
    angle = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=-1))
    return np.abs(angle.sum(axis=1)) > np.pi


def in_polygon(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return whether bottles at (x, y) are inside."""
    search, bottles = RegionSearch(), column(x, y)
    search.add(np.array([[5.0, 5.0], [6.0, 5.0], [5.0, 6.0]]))
    region = search.add(corners)
    inside = np.zeros(x.size, dtype=bool)
    inside[search.inside(region, bottles, 0, 0)] = True
    return inside


def column(x: np.ndarray, y: np.ndarray) -> Any:
    return SimpleNamespace(x=x, y=y, id=np.arange(x.size))


def test_points_in_a_concave_polygon() -> None:
    """Corners may be in either order."""
    points = np.random.default_rng(2).uniform(-1.2, 1.2, (5000, 2))
    expected = winding(STAR, points)
    assert 500 < expected.sum() < 4500
    np.testing.assert_array_equal(in_polygon(STAR, *points.T), expected)
    np.testing.assert_array_equal(in_polygon(STAR[::-1], *points.T), expected)


def test_points_on_shared_edges_belong_to_one_polygon() -> None:
    """A point on the edge or corner between adjoining regions belongs to exactly one of them."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 2.0, 9), np.linspace(0.0, 2.0, 9)))
    inner = (x > 0.0) & (x < 2.0) & (y > 0.0) & (y < 2.0)
    tiles = [np.array([[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]) for i in (0.0, 1.0) for j in (0.0, 1.0)]
    count = sum(in_polygon(tile, x, y).astype(int) for tile in tiles)
    np.testing.assert_array_equal(count[inner], 1)
    halves = [np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]), np.array([[0.0, 0.0], [2.0, 2.0], [0.0, 2.0]])]
    count = sum(in_polygon(half, x, y).astype(int) for half in halves)
    np.testing.assert_array_equal(count[inner], 1)


def test_bottles_removed_since_the_search_are_not_inside() -> None:
    search, bottles = RegionSearch(), column(np.array([0.2, 0.1, 3.0, 0.3]), np.full(4, 0.1))
    region = search.add(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    assert search.inside(region, bottles, 7, 4).tolist() == [0, 1, 3]
    bottles.id[1] = -1
    assert search.inside(region, bottles, 7, 5).tolist() == [0, 3]
    bottles.x[2] = 0.0
    assert search.inside(region, bottles, 8, 5).tolist() == [0, 2, 3]


def test_bottles_leave_in_the_region_and_ids_are_not_used_again() -> None:
    """An endless stream through a short line: few slots, growing ids, mass in equals mass out."""
    sim = simulation(
        tick=0.01,
        accuracy={"per_tick": 20},
        base=base(0.4),
        contacts=[contact(5000.0, damping=("normal", 2.0)), contact(5000.0, "steel", damping=("normal", 2.0))],
        belts={"belt": belt(1.0)},
        rails={"far": segment((4.0, -1.0), (4.0, 1.0))},
        infeeds={"in": {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 1.0, "gap": 0.01}},
        outfeeds={
            # A concave region: the line enters the notch's mouth at x = 1, its bottom at x = 1.2.
            "out": {"region": [[1.0, -0.5], [2.0, -0.5], [2.0, 0.5], [1.0, 0.5], [1.2, 0.0]]},
            "unused": {"region": [[0.0, 1.0], [1.0, 1.0], [0.5, 2.0]]},
        },
    )
    removed = sim.process_image.signal_names.index("outfeeds/out/removed")
    unused = sim.process_image.signal_names.index("outfeeds/unused/removed")
    slots = sim._state.world.bottles.id.size
    furthest = 0.0
    for _ in range(700):
        sim.advance()
        furthest = max(furthest, sim.bottles().x.max())
    assert 1.2 - 0.01 <= furthest < 1.2 + 1e-9
    assert sim.counts.fed > 45
    assert sim.signals()[removed] == sim.counts.removed > 40
    assert sim.signals()[unused] == 0
    assert sim.bottles().id.tolist() == list(range(sim.counts.removed, sim.counts.fed))
    assert sim._state.world.bottles.id.size == slots
    assert sim.bottles().x.max() + RADIUS < FAR

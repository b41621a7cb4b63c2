# SPDX-License-Identifier: Apache-2.0
"""Verlet lists contain all touching pairs until a bottle has moved by half the skin."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scenes import RADIUS, arc, bottle, contact, kind, polyline, scene, segment
from worlds import FAR, callable_part, nearest_on_arc, nearest_on_segment, rail_scene, state_of

from conveyor_sim.engine.lists.rebuild import moved_too_far as moved_too_far_part
from conveyor_sim.engine.lists.rebuild import rebuild
from conveyor_sim.engine.world_views import lists_of
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.empty_world import empty_pairs

moved_too_far = callable_part(moved_too_far_part)

RANDOM = np.random.default_rng(3)
RADII = np.array([RADIUS, 0.03, 0.11])


def bottles_only() -> State:
    """Return bottles of three sizes, with room for many; two bottles that make contacts possible are far away."""
    fields = {
        "bottle_types": {f"type{n}": kind(radius) for n, radius in enumerate(RADII)},
        "contacts": [contact(1000.0)],
        "floor": "none",
        "bottles": [bottle(FAR, FAR, type="type0"), bottle(-FAR, FAR, type="type1")],
    }
    return state_of(scene(**fields), np.empty((0, 2)))


def crowd(count: int, size: float, centre: tuple[float, float] = (0.0, 0.0)) -> tuple[State, np.ndarray, np.ndarray]:
    """Return bottles at random positions in a box, overlapping or not."""
    state = bottles_only()
    points = RANDOM.uniform(-size, size, (count, 2)) + centre
    kinds = RANDOM.integers(0, 3, count)
    for (x, y), type_ in zip(points, kinds, strict=True):
        state.add(int(type_), x, y, 0.0, 0.0, 0.0, 0.0)
    state.make_lists()
    return state, points, RADII[kinds]


def listed(state: State) -> set[tuple[int, int]]:
    pairs = state.world.pairs
    assert pairs is not None
    count = pairs.used[0]
    return set(zip(pairs.i[:count].tolist(), pairs.j[:count].tolist(), strict=True))


def within(points: np.ndarray, radii: np.ndarray, margin: float) -> set[tuple[int, int]]:
    """Return all pairs nearer than R_i + R_j + margin, by brute force."""
    i, j = np.triu_indices(len(points), 1)
    near = np.hypot(*(points[i] - points[j]).T) < radii[i] + radii[j] + margin
    return set(zip(i[near].tolist(), j[near].tolist(), strict=True))


@pytest.mark.parametrize(
    ("count", "size", "centre"),
    [(2, 0.1, (0, 0)), (200, 0.5, (0, 0)), (400, 3.0, (-7, 2)), (300, 1.0, (99_000, -99_000)), (150, 500.0, (0, 0))],
)
def test_the_pair_list_holds_all_pairs_within_the_skin_and_no_others(
    count: int, size: float, centre: tuple[float, float]
) -> None:
    state, points, radii = crowd(count, size, centre)
    assert listed(state) == within(points, radii, state.model.settings.skin)


def test_pairs_are_sorted_by_slot_whatever_the_cells() -> None:
    """The order of summation, hence the bits, must not depend on the time of a rebuild."""
    state, _, _ = crowd(300, 0.8)
    pairs = state.world.pairs
    assert pairs is not None
    order = pairs.i[: pairs.used[0]].astype(np.int64) * 100_000 + pairs.j[: pairs.used[0]]
    assert np.all(np.diff(order) > 0)
    assert np.all(pairs.i[: pairs.used[0]] < pairs.j[: pairs.used[0]])


def test_touching_pairs_are_listed_until_someone_has_moved_by_half_the_skin() -> None:
    """In the worst case both move towards each other."""
    state, points, radii = crowd(300, 1.0)
    reach = 0.5 * state.model.settings.skin
    for _ in range(20):
        angle = RANDOM.uniform(0.0, 2.0 * math.pi, len(points))
        moved = points + 0.9999 * reach * np.column_stack([np.cos(angle), np.sin(angle)])
        assert within(moved, radii, 0.0) <= listed(state)
        state.world.bottles.x[:300], state.world.bottles.y[:300] = moved.T
        assert not moved_too_far(state.world.bottles, state.world.neighbourhood, state.model.settings.skin, 0, 300)
    state.world.bottles.x[17] = points[17, 0] + 1.0001 * reach
    state.world.bottles.y[17] = points[17, 1]
    assert moved_too_far(state.world.bottles, state.world.neighbourhood, state.model.settings.skin, 0, 300)


def test_a_removed_bottle_leaves_the_lists() -> None:
    state, points, radii = crowd(100, 0.4)
    for slot in range(0, 100, 3):
        state.remove(slot)
    state.make_lists()
    stay = {slot for slot in range(100) if slot % 3}
    expected = {pair for pair in within(points, radii, state.model.settings.skin) if set(pair) <= stay}
    assert listed(state) == expected


def test_each_pair_has_the_constants_of_its_types() -> None:
    """Columns beside the list hold the constants of both types, in either order."""
    stiffness = {("a", "a"): 1.0, ("a", "b"): 2.0, ("b", "b"): 3.0}
    fields = {
        "bottle_types": {"a": kind(material="a"), "b": kind(material="b")},
        "contacts": [{"between": list(pair), "stiffness": value} for pair, value in stiffness.items()],
        "floor": "none",
        "bottles": [bottle(FAR, FAR, type="a"), bottle(-FAR, FAR, type="b")],
    }
    kinds = np.array([0, 1, 1, 0, 1, 0])
    pairs = state_of(scene(**fields), RANDOM.uniform(0.0, 0.05, (6, 2)), kinds=kinds).world.pairs
    assert pairs is not None
    assert pairs.used[0] == 15
    for p in range(15):
        names = sorted("ab"[kinds[slot]] for slot in (pairs.i[p], pairs.j[p]))
        assert pairs.law.stiffness[p] == stiffness[names[0], names[1]]


def test_a_list_too_short_is_told_and_grown() -> None:
    """`rebuild` returns the entries that each list needs, and the lists stay stale until they fit."""
    state, points, radii = crowd(40, 0.1)
    state.world = state.world._replace(pairs=empty_pairs(state.model, 8))
    needed = rebuild(lists_of(state.world))
    assert needed[0] == len(within(points, radii, state.model.settings.skin)) > 8
    assert state.world.neighbourhood.stale[0] == 1
    state.make_lists()
    assert state.world.neighbourhood.stale[0] == 0
    assert listed(state) == within(points, radii, state.model.settings.skin)


def test_a_list_that_is_exactly_full_holds_all_pairs() -> None:
    """Candidates that are no pairs come after the last pair; they must not take its place."""
    state, points, radii = crowd(200, 0.5)
    expected = within(points, radii, state.model.settings.skin)
    state.world = state.world._replace(pairs=empty_pairs(state.model, len(expected)))
    assert rebuild(lists_of(state.world))[0] == len(expected)
    assert listed(state) == expected


def plant() -> tuple[State, np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Return random rails, with the true distance of each bottle from each straight piece and each arc."""
    corners = np.cumsum(RANDOM.normal(0.0, 0.15, (60, 2)), axis=0)
    rails = {"walk": polyline(corners)}
    straight = list(pairwise(corners))
    for n in range(30):
        start, end = RANDOM.uniform(-1.5, 1.5, (2, 2))
        rails[f"s{n}"] = segment(tuple(start), tuple(end))
        straight.append((start, end))
    bends = []  # with mouths wider than a bottle: other arcs become two pieces each
    for n in range(30):
        centre, shape = tuple(RANDOM.uniform(-1.5, 1.5, 2)), RANDOM.uniform([0.3, -3.0, 0.1], [1.0, 3.0, 5.0])
        rails[f"a{n}"] = arc(centre, *shape)
        bends.append((centre, *shape))
    points = RANDOM.uniform(-2.0, 2.0, (1000, 2))

    def apart(nearest: np.ndarray) -> np.ndarray:
        return np.hypot(*(points - nearest).T)

    return (
        state_of(rail_scene(rails), points),
        points,
        [apart(nearest_on_segment(*ends, points)) for ends in straight],
        [apart(nearest_on_arc(*bend, points)) for bend in bends],
    )


def test_rails_within_reach_are_listed_in_order() -> None:
    """All rails within R + skin/2 are listed, because the bottle may move by skin/2."""
    state, points, to_straight, to_bends = plant()
    reach = RADIUS + 0.5 * state.model.settings.skin
    for near, apart in ((state.world.near_segments, to_straight), (state.world.near_arcs, to_bends)):
        assert near is not None
        for slot in range(len(points)):
            pieces = near.piece[near.start[slot] : near.start[slot + 1]].tolist()
            assert pieces == sorted(set(pieces))
            assert {n for n, distance in enumerate(apart) if distance[slot] <= reach} <= set(pieces)
        assert near.start[len(points)] > 100

# SPDX-License-Identifier: Apache-2.0
"""Tangential springs are state: they survive rebuilds and longer lists, and leave with their bottle."""

from __future__ import annotations

from typing import Any

import numpy as np
from scenes import arc, bottle, contact, polyline, scene
from worlds import FAR, advance

from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State

SPRING: dict[str, Any] = {"friction": 0.5, "tangential": {"stiffness": 3000.0, "damping": 0.2}}
DT = 2e-5


def pressed() -> State:
    """Return twelve bottles squeezed in a corner of straight rails and an arc, sliding and spinning."""
    points = [(0.062 + 0.125 * column, 0.063 + 0.126 * row) for row in range(3) for column in range(4)]
    tested = scene(
        contacts=[contact(5000.0, **SPRING), contact(8000.0, "steel", **SPRING)],
        rails={"corner": polyline([(0.0, 1.0), (0.0, 0.0), (1.0, 0.0)]), "bend": arc((0.25, 0.2), 0.26, 0.0, 1.5)},
        floor="none",
        bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)],
    )
    state, random = State(build_model(tested)), np.random.default_rng(2)
    for x, y in points:
        state.add(0, x, y, 0.0, *random.normal(0.0, 0.2, 2), random.normal(0.0, 5.0))
    state.make_lists()
    return state


def run(state: State, steps: int) -> None:
    assert advance("semi_implicit_euler", state.world, steps, DT) == steps


def elongations(state: State) -> dict[tuple[str, int, int], float]:
    """Return the elongations of all loaded springs, m, by their ends."""
    world, lengths = state.world, {}
    assert world.pairs is not None
    assert world.pairs.spring is not None
    for p in range(world.pairs.used[0]):
        lengths["bottle", int(world.pairs.i[p]), int(world.pairs.j[p])] = float(world.pairs.spring.elongation[p])
    for name, near in (("segment", world.near_segments), ("arc", world.near_arcs)):
        assert near is not None
        assert near.springs is not None
        for i in range(world.bottles.id.size):
            for entry in range(near.start[i], near.start[i + 1]):
                lengths[name, i, int(near.piece[entry])] = float(near.springs.elongation[entry])
    return {key: value for key, value in lengths.items() if value != 0.0}


def test_a_rebuilt_list_keeps_the_springs() -> None:
    state = pressed()
    run(state, 60)
    before = elongations(state)
    assert {key[0] for key in before} == {"bottle", "segment", "arc"}
    state.world.neighbourhood.stale[0] = 1
    state.make_lists()
    assert elongations(state) == before


def test_a_rebuild_at_any_time_leaves_no_trace() -> None:
    """Not a bit differs; nor do lists that are too short, or room for more bottles, change anything."""
    plain, disturbed = pressed(), pressed()
    run(plain, 300)
    for n in range(10):
        run(disturbed, 30)
        if n == 4:
            disturbed._resize(disturbed.world.bottles.id.size + 40)
        disturbed.world.neighbourhood.stale[0] = 1
        disturbed.make_lists()
    assert elongations(disturbed) == elongations(plain)
    for name in ("x", "y", "vx", "vy"):
        count = plain.world.bottles.id.size
        np.testing.assert_array_equal(
            getattr(disturbed.world.bottles, name)[:count], getattr(plain.world.bottles, name)
        )


def test_a_list_that_has_to_grow_keeps_the_springs() -> None:
    """Bottles approach: lists that are too short for a rebuild are lengthened, and no spring is lost."""
    state = pressed()
    run(state, 60)
    before = elongations(state)
    for n in range(80):
        state.add(0, 3.0 + 0.12 * (n % 9), 3.0 + 0.12 * (n // 9), 0.0, 0.0, 0.0, 0.0)
    pairs = state.world.pairs
    assert pairs is not None
    capacity = pairs.i.size
    state.make_lists()
    assert state.world.pairs is not None
    assert state.world.pairs.i.size > capacity
    assert elongations(state) == before


def test_springs_go_with_their_bottle() -> None:
    """Another bottle may get the slot before the next rebuild."""
    state = pressed()
    run(state, 60)
    gone = 5
    before = elongations(state)
    state.remove(gone)
    state.add(0, 5.0, 5.0, 0.0, 0.0, 0.0, 0.0)
    assert state.world.bottles.id[gone] == 12
    state.make_lists()
    stay = {key: value for key, value in before.items() if gone not in (key[1:] if key[0] == "bottle" else key[1:2])}
    assert len(stay) < len(before)
    assert elongations(state) == stay

# SPDX-License-Identifier: Apache-2.0
"""Forces by pair, summed by bottle through slots: equal to a loop over all pairs, for any number of neighbours."""

import math

import numpy as np
from scenes import bottle, contact, kind, scene
from worlds import FAR, evaluate, state_of

from conveyor_sim.engine.contact.slots import WIDTH
from conveyor_sim.physics.state import State

STIFFNESS = 5000.0
BIG, SMALL = 0.2, 0.01
"""Radii, m: a big bottle has room for over sixty small ones around it."""


def around_a_big_one() -> tuple[State, np.ndarray, np.ndarray]:
    """Return two big bottles among small ones that overlap them and each other."""
    random = np.random.default_rng(5)
    angle = np.linspace(0.0, 2.0 * math.pi, 80, endpoint=False)
    ring = (BIG + 0.9 * SMALL) * np.column_stack([np.cos(angle), np.sin(angle)]) + random.normal(0.0, 0.001, (80, 2))
    points = np.vstack([ring[:30], [(0.0, 0.0), (1.9 * BIG, 0.0)], ring[30:]])
    kinds = np.ones(len(points), int)
    kinds[30:32] = 0
    fields = {"bottle_types": {"big": kind(BIG, 1.0), "small": kind(SMALL, 0.01)}, "contacts": [contact(STIFFNESS)]}
    tested = scene(**fields, floor="none", bottles=[bottle(FAR, FAR, type="big"), bottle(-FAR, FAR, type="small")])
    return state_of(tested, points, kinds=kinds), points, np.array([BIG, SMALL])[kinds]


def test_a_bottle_with_more_neighbours_than_slots() -> None:
    """The force (N) on each bottle is the sum over all pairs, k delta along the line of centres."""
    state, points, radius = around_a_big_one()
    evaluate(state.world)
    slots = state.world.slots
    assert slots is not None
    assert slots.filled[30] > 10 * WIDTH
    away = points[:, None] - points
    distance = np.hypot(*np.moveaxis(away, -1, 0)) + np.eye(len(points))
    overlap = np.maximum(radius[:, None] + radius - distance, 0.0) * (1.0 - np.eye(len(points)))
    expected = (STIFFNESS * overlap / distance)[:, :, None] * away
    load = np.column_stack([state.world.load.fx, state.world.load.fy])[: len(points)]
    # 100 forces of up to 100 N are added in another order.
    np.testing.assert_allclose(load, expected.sum(axis=1), atol=1e-10)


def test_every_pair_is_in_one_slot_of_each_partner() -> None:
    """The first of a pair has its entry at p, the second at P + p, all in order of the partner."""
    state, _, _ = around_a_big_one()
    pairs, slots = state.world.pairs, state.world.slots
    assert pairs is not None
    assert slots is not None
    used, capacity = pairs.used[0], pairs.i.size
    for b in range(state.world.bottles.id.size):
        entries = [int(e) for e in slots.entry[b * WIDTH : (b + 1) * WIDTH] if e != 2 * capacity]
        entries += [int(e) for e in slots.more_entry[slots.more_start[b] : slots.more_start[b + 1]]]
        partners = [int(pairs.j[e]) if e < capacity else int(pairs.i[e - capacity]) for e in entries]
        expected = sorted(pairs.j[:used][pairs.i[:used] == b].tolist() + pairs.i[:used][pairs.j[:used] == b].tolist())
        assert partners == expected

# SPDX-License-Identifier: Apache-2.0
"""Energy of contacts: closed forms of the laws, and the potential of rails that push together."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, RADIUS, bottle, contact, kind, polyline, scene
from worlds import ALONE, FAR, rail_forces, rail_scene, state_of

from conveyor_sim.engine.observers.stored_energy import ELASTIC, KINETIC, SPRINGS, stored_energy
from conveyor_sim.physics.state import State

DEEP = 0.004
"""m"""


def stored(state: State) -> np.ndarray:
    return stored_energy(state.world, ALONE.rail_contacts)


def test_contacts_hold_what_their_laws_take_up() -> None:
    """k d^2 / 2 (glass on pet), 2/5 k_h d^2.5 (glass), and the area under a table, beyond its end, too (pet)."""
    table = [[0.001, 2.0], [0.003, 10.0]]
    laws = scene(
        bottle_types={"bottle": kind(), "other": kind(material="pet")},
        contacts=[
            contact(None, hertz_stiffness=1e6),
            contact(3000.0, "pet"),
            {"between": ["pet", "pet"], "table": table},
        ],
        bottles=[bottle(FAR, FAR), bottle(FAR + 1.0, FAR)],
        **NO_FLOOR,
    )
    near = 2.0 * RADIUS - DEEP
    points = [(x, y) for y in (0.0, 1.0, 2.0) for x in (0.0, near)]
    area = 0.5 * 0.001 * 2.0 + 0.002 * 6.0 + 0.001 * 12.0
    expected = {(0, 0): 0.4 * 1e6 * DEEP**2.5, (0, 1): 0.5 * 3000.0 * DEEP**2, (1, 1): area}
    for kinds, energy in expected.items():
        state = state_of(laws, points[:2], kinds=np.array(kinds))
        assert stored(state)[ELASTIC] == pytest.approx(energy, rel=1e-9)
    everything = stored(state_of(laws, points, kinds=np.array([0, 0, 0, 1, 1, 1]), velocities=np.full((6, 2), 0.5)))
    assert everything == pytest.approx([6 * 0.5 * 0.2 * 0.5, sum(expected.values()), 0.0, 0.0], rel=1e-9)
    assert (KINETIC, ELASTIC, SPRINGS) == (0, 1, 2)


def test_mindlins_spring_holds_by_the_overlap_at_hand() -> None:
    """k_t xi^2 / 2 with k_t = 1.5 x 0.8 k_h sqrt(d)."""
    springy = {"friction": 0.3, "tangential": {"stiffness_ratio": 0.8}}
    laws = scene(
        contacts=[contact(None, hertz_stiffness=1e6, **springy)],
        bottles=[bottle(FAR, FAR), bottle(FAR + 1.0, FAR)],
        **NO_FLOOR,
    )
    state = state_of(laws, [(0.0, 0.0), (2.0 * RADIUS - DEEP, 0.0)], kinds=np.array([0, 0]))
    state.world.pairs.spring.elongation[0] = 2e-5
    assert stored(state)[SPRINGS] == pytest.approx(0.5 * 1.2e6 * math.sqrt(DEEP) * 2e-5**2, rel=1e-9)


@pytest.mark.parametrize(
    "course",
    [
        [(-1.0, 0.2), (0.0, 0.0), (1.0, 0.2)],
        [(-1.0, 1.0), (0.0, 0.0), (1.0, 1.0)],
        [(-1.0, 0.3), (-0.02, 0.0), (0.02, 0.0), (1.0, 0.3)],
        [(-1.0, -0.5), (0.0, 0.0), (1.0, -0.5)],
    ],
    ids=["shallow pocket", "right angle", "three pieces", "convex"],
)
def test_pieces_of_a_rail_that_push_together_give_back_what_they_took(course: Any) -> None:
    """The force is minus the slope of the energy at every position in the corner."""
    rails = {"corner": polyline(course)}
    points = [(x, RADIUS - y) for x in (-0.013, 0.0, 0.004, 0.011) for y in (0.0005, 0.003)]
    step = 1e-6

    def energy(x: float, y: float) -> float:
        return float(stored(state_of(rail_scene(rails), [(x, y)]))[ELASTIC])

    slopes = [
        (
            (energy(x + step, y) - energy(x - step, y)) / (2.0 * step),
            (energy(x, y + step) - energy(x, y - step)) / (2.0 * step),
        )
        for x, y in points
    ]
    forces = rail_forces(rails, points)
    assert np.abs(forces).max() > 0.5
    # At the onset of sharing the slope bends within a step.
    np.testing.assert_allclose(-np.array(slopes), forces, atol=2e-3 * np.abs(forces).max())

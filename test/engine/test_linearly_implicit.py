# SPDX-License-Identifier: Apache-2.0
"""The linearly implicit method: exact energy in a lasting contact, momentum, and steps far beyond explicit limits."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenes import COMMON, MASS, RADIUS, base, belt, bottle, contact, every_law, polyline, scene, simulation, with_bends
from worlds import FAR, advance, state_of

from conveyor_sim.simulation import Simulation

G, MU = 9.81, 0.4
METHOD = "linearly_implicit"
LAWS: dict[str, Any] = {"damping": ("normal", 0.1), "friction": 0.1}


def test_a_spring_in_contact_keeps_its_energy() -> None:
    """The midpoint rule conserves a quadratic energy if the tangent is the spring's and the system is solved."""
    stiffness, depth, steps = 5000.0, 0.01, 30
    tested = scene(
        **every_law([contact(stiffness)]),
        floor="none",
        accuracy={"integrator": METHOD},
        bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)],
    )
    state = state_of(tested, [(0.0, 0.0), (2.0 * RADIUS - depth, 0.0)])
    quarter = 0.5 * math.pi * math.sqrt(0.5 * MASS / stiffness)
    bottles = state.world.bottles
    for _ in range(steps):
        advance(METHOD, state.world, 1, 0.9 * quarter / steps)
        overlap = 2.0 * RADIUS - (bottles.x[1] - bottles.x[0])
        assert overlap > 0.0
        energy = 0.5 * MASS * float((bottles.vx[:2] ** 2).sum()) + 0.5 * stiffness * overlap**2
        # Solved to 1e-8 of each kick.
        assert energy == pytest.approx(0.5 * stiffness * depth**2, rel=1e-7)


def packing(ratio: float, stiffness: float = 1e5) -> Simulation:
    """Return 48 hexagonally packed bottles, pressed onto a wall by a belt; steps: `ratio` times the explicit limit."""
    rows, columns, pitch = 6, 8, 0.131
    height, length = (rows - 1) * pitch * math.sqrt(3.0) / 2.0, columns * pitch + 0.2
    side = RADIUS + 0.0005
    dt = round(ratio * 2.0 / math.sqrt(6.0 * stiffness / MASS), 9)
    grid = {
        "type": "bottle",
        "origin": [length - RADIUS - 0.001 - (columns - 0.5) * pitch, 0.0],
        "rows": rows,
        "columns": columns,
        "pitch": pitch,
        "pattern": "hexagonal",
    }
    walls = [(0.0, -side), (length, -side), (length, height + side), (0.0, height + side)]
    fields = {
        "tick": dt,
        "duration": 1000 * dt,
        "gravity": G,
        "accuracy": {"integrator": METHOD, "per_tick": 1},
        "contacts": [contact(stiffness, **LAWS), contact(2.0 * stiffness, "steel", **LAWS)],
        "effects": COMMON,
        "base": base(MU),
        "belts": {"belt": belt(0.25, (-1.0, -1.0), 5.0, 5.0)},
        "rails": {"walls": polyline(walls)},
        "bottles": [{"grid": grid}],
    }
    return simulation(**with_bends(fields))


@pytest.mark.parametrize("ratio", [5.0, 20.0])
def test_a_packing_rests_at_steps_far_beyond_the_explicit_limit(ratio: float) -> None:
    """The wall carries mu m g per bottle minus the friction of the sides; speeds stay small."""
    sim = packing(ratio)
    fastest = 0.0
    while sim.time < 2.0:
        sim.advance()
        state = sim.bottles()
        fastest = max(fastest, float(np.hypot(state.vx, state.vy).max()))
    assert fastest < 0.5
    assert np.hypot(state.vx, state.vy).max() < 1e-3
    contacts = sim.contacts()
    wall = (contacts.kind == 1) & (contacts.nx > 0.9)
    sides = (contacts.kind == 1) & (np.abs(contacts.ny) > 0.9)
    carried = contacts.normal_force[wall].sum() + np.abs(contacts.tangential_force[sides]).sum()
    # The rest is still in motion: bottles creep along each other below v_lim.
    assert carried == pytest.approx(48 * MU * MASS * G, rel=0.05)


def test_base_friction_does_not_chatter_at_ten_times_its_explicit_limit() -> None:
    """A bottle set down on a belt is carried along: its slip falls to rest and never reverses."""
    limit = 0.01 / (MU * G)
    tick = round(10.0 * limit, 6)
    fields = {
        "tick": tick,
        "duration": 1000 * tick,
        "gravity": G,
        "accuracy": {"integrator": METHOD, "per_tick": 1},
        "contacts": [contact(1e5, **LAWS), contact(2e5, "steel", **LAWS)],
        "effects": COMMON,
        "base": base(MU),
        "belts": {"belt": belt(0.5, (-1.0, -1.0), 5.0, 5.0)},
        "rails": {"far": polyline([(0.0, 3.0), (1.0, 3.0)])},
        "bottles": [bottle(0.0, 0.0), bottle(0.0, 1.0)],
    }
    sim = simulation(**with_bends(fields))
    slips = []
    for _ in range(60):
        sim.advance()
        slips.append(0.5 - float(sim.bottles().vx[0]))
    rises = [later - earlier for earlier, later in pairwise(slips)]
    assert max(rises) < 1e-9  # m/s: residual of the solver
    assert min(slips) > -1e-9
    assert slips[-1] < 1e-6


def test_momentum_of_a_closed_system() -> None:
    """Momentum is conserved however early the solver stops, because contact forces are equal and opposite."""
    rng = np.random.default_rng(4)
    places = [(0.14 * i + 0.005 * rng.random(), 0.14 * j + 0.005 * rng.random()) for i in range(5) for j in range(5)]
    speeds = rng.normal(0.0, 0.5, (25, 2))
    sim = simulation(
        accuracy={"integrator": METHOD, "per_tick": 4},
        **every_law([contact(1e5, damping=("normal", 5.0), friction=0.3)]),
        floor="none",
        bottles=[bottle(x, y, float(u), float(v)) for (x, y), (u, v) in zip(places, speeds, strict=True)],
    )
    before = speeds.sum(axis=0)
    touched = 0
    for _ in range(40):
        sim.advance()
        touched += len(sim.contacts().a)
    state = sim.bottles()
    assert touched > 20
    np.testing.assert_allclose([state.vx.sum(), state.vy.sum()], before, rtol=0.0, atol=1e-12)

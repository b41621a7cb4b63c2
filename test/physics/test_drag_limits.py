# SPDX-License-Identifier: Apache-2.0
"""Longest stable step for a drag, that is for friction at rest: gamma dt = 2, 1 and 2.785 for the explicit methods,
and any length where friction is implicit.

Bounds on the time step scale with it (`Method.drag_limit`), so that each integrator keeps the same margin.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, order, scene, segment
from worlds import FAR, advance, state_of

from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.physics.timestep.methods import METHODS

LIMIT, MU, G = 1e-5, 0.5, 9.81
"""v_lim (m/s) is so low that steps in question are far too short for the springs to matter."""
K, DEPTH = 5000.0, 1e-4
LIMITS = {"semi_implicit_euler": 2.0, "velocity_verlet": 1.0, "rk4": 2.785}
STEPS = 300


def resting(integrator: str, points: Any, floor: float, solver: str = "explicit") -> State:
    given = scene(
        accuracy={"integrator": integrator},
        contacts=[contact(K, friction=MU)],
        floor={"friction": floor},
        slip_limit=LIMIT,
        friction_solver=solver,
        lever_arm="radius",
        gravity=G,
        bottles=[bottle(FAR, FAR), bottle(-FAR, FAR)],
    )
    # So little slip that friction is a drag.
    velocities = 1e-3 * LIMIT * np.random.default_rng(1).uniform(-1.0, 1.0, (len(points), 2))
    return state_of(given, points, velocities)


def shaking(state: State, integrator: str, dt: float) -> float:
    """Largest change of speed (m/s) that the last forces make in a step, after STEPS steps in one call.

    Velocity Verlet shakes in its forces and between its steps, and hardly in its velocities.
    """
    advance(integrator, state.world, STEPS, dt)
    spin, load, bottles = state.world.spin, state.world.load, state.world.bottles
    assert spin is not None
    turned = RADIUS * np.abs(spin.moment * spin.inverse_inertia)
    # In a packing the turning alone: normal forces stay.
    pushed = np.hypot(load.fx, load.fy) * bottles.inverse_mass if state.world.bottles.id.max() == 0 else 0.0 * turned
    return dt * float(max(pushed.max(), turned.max()))


def packing() -> tuple[list[tuple[float, float]], float, Any]:
    """A bottle with six around it, all pressed into each other by DEPTH; gamma (1/s) of its fastest shear; all."""
    apart = 2.0 * RADIUS - DEPTH
    ring = [(apart * math.cos(k * math.pi / 3.0), apart * math.sin(k * math.pi / 3.0)) for k in range(6)]
    points = np.array([(0.0, 0.0), *ring])
    drag = np.zeros((21, 21))
    for i in range(7):
        for j in range(i):
            away = points[j] - points[i]
            if np.hypot(*away) < apart + 0.1 * DEPTH:
                nx, ny = away / apart
                slip = np.zeros(21)
                # vx, vy and R omega, which has the inertia of the mass for a hoop.
                slip[3 * i : 3 * i + 3] = -ny, nx, 1.0
                slip[3 * j : 3 * j + 3] = ny, -nx, 1.0
                drag += 2.0 * MU * K * DEPTH / (LIMIT * MASS) * np.outer(slip, slip)
    return [(float(x), float(y)) for x, y in points], float(np.linalg.eigvalsh(drag)[-1]), drag


@pytest.mark.parametrize("integrator", LIMITS)
def test_a_bottle_on_a_floor(integrator: str) -> None:
    """gamma = 2 mu g / v_lim; beyond the limit it shakes within v_lim, for good."""
    gamma = 2.0 * MU * G / LIMIT
    for share, calm in [(0.9, True), (1.1, False)]:
        state = resting(integrator, [(0.0, 0.0)], MU)
        shaken = shaking(state, integrator, share * LIMITS[integrator] / gamma)
        assert shaken < 1e-6 * LIMIT if calm else shaken > 0.01 * LIMIT


@pytest.mark.parametrize("integrator", LIMITS)
def test_a_hexagonal_packing_under_pressure(integrator: str) -> None:
    points, gamma, _ = packing()
    for share, calm in [(0.9, True), (1.1, False)]:
        # On a floor that is as good as smooth: the kernels are those of the bottle on a floor.
        state = resting(integrator, points, 1e-9)
        spin = state.world.spin
        assert spin is not None
        spin.omega[:7] = 1e-3 * LIMIT / RADIUS * np.random.default_rng(2).uniform(-1.0, 1.0, 7)
        shaken = shaking(state, integrator, share * LIMITS[integrator] / gamma)
        assert shaken < 1e-6 * LIMIT if calm else shaken > 0.01 * LIMIT


@pytest.mark.parametrize("integrator", LIMITS)
def test_bounds_keep_the_same_share_of_the_limit(integrator: str) -> None:
    """Bounds are half of the limit of friction, and a quarter of that of a dashpot: in a packing gamma triples."""
    assert METHODS[integrator].drag_limit == pytest.approx(0.5 * LIMITS[integrator], rel=2e-3)
    model = build_model(
        scene(
            accuracy={"integrator": integrator},
            contacts=[
                contact(K, friction=MU, damping=("normal", 3.0)),
                contact(K, "steel", ("normal", 3.0), MU, tangential={"stiffness": 1e3, "damping": 2.0}),
            ],
            rails={"edge": segment((0.0, 6.0), (1.0, 6.0))},
            base=base(MU),
            belts={"belt": belt(0.1)},
            bottle_types={"bottle": {"radius": RADIUS, "mass": MASS, "material": "glass", "base_radius": 0.5 * RADIUS}},
            bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)],
            gravity=G,
            slip_limit=LIMIT,
        )
    )
    gammas = {
        "base friction": 2.0 * MU * G / LIMIT,
        "spin on the base": 0.25 * 2.0 * MU * G / LIMIT,
        "normal damping": 2.0 * 3.0 / (MASS / 2.0),
        "tangential damping": 2.0 * 2.0 / (MASS / 2.0),
        # At the load of a few bottles in a zigzag, three times the pull of all (test/physics/effects/test_load.py).
        "contact friction": 2.0 * MU * (2.0 / MASS) * (3.0 * 2.0 * MU * MASS * G) / LIMIT,
    }
    shares = {b.name: gammas[b.name] * b.dt / LIMITS[integrator] for b in model.bounds if b.name in gammas}
    assert shares.keys() >= gammas.keys() - {"contact friction"}
    assert shares == pytest.approx(dict.fromkeys(shares, 0.5), rel=2e-3)


@pytest.mark.parametrize("integrator", LIMITS)
def test_implicit_friction_stops_a_slip(integrator: str) -> None:
    """On a floor, from far beyond v_lim and from far below, in steps of up to 100 times the bound: it dies out."""
    for steps in (0.1, 1.0, 10.0, 100.0):
        dt = steps * 0.5 * LIMIT / (MU * G)
        speeds = np.array([1e-3 * LIMIT, 0.7 * MU * G * dt, 5.3 * MU * G * dt + LIMIT])
        slips = [speeds]
        for n in range(1, 40):
            # In one call each: the first step of a call is like no other.
            state = resting(integrator, [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], MU, "implicit")
            bottles = state.world.bottles
            bottles.vx[:3], bottles.vy[:3] = speeds, 0.0
            advance(integrator, state.world, n, dt)
            slips.append(bottles.vx[:3].copy())
        if integrator == "velocity_verlet":
            # The kick of a step is the mean of two forces, so the slip may overshoot.
            assert all(np.all(np.abs(after) < speeds) for after in slips[1:])
        elif integrator == "semi_implicit_euler":
            # Friction is that of a slip up to v_lim/(2 mu g) before the end of the step: a slip may reverse by v_lim/2.
            assert all(np.all((after >= -0.5 * LIMIT) & (np.abs(after) < speeds)) for after in slips[1:])
        else:
            assert all(np.all((after >= 0.0) & (after < before)) for before, after in pairwise(slips))
        assert np.all(np.abs(slips[-1]) < (0.1 if steps < 1.0 else 1e-5) * speeds)


@pytest.mark.parametrize("integrator", LIMITS)
def test_implicit_friction_is_stable_in_a_packing(integrator: str) -> None:
    """A hundred times beyond the limit of explicit friction: what slips comes to rest."""
    points, gamma, drag = packing()
    slips = []
    for n in (0, 1, 2, 3, 5, 10, 20, 40):
        state = resting(integrator, points, 1e-9, "implicit")
        bottles, spin = state.world.bottles, state.world.spin
        assert spin is not None
        spin.omega[:7] = 1e-3 * LIMIT / RADIUS * np.random.default_rng(2).uniform(-1.0, 1.0, 7)
        advance(integrator, state.world, n, 100.0 * LIMITS[integrator] / gamma)
        moving = np.column_stack([bottles.vx, bottles.vy, RADIUS * spin.omega])[:7].ravel()
        slips.append(float(moving @ drag @ moving))
    if integrator == "rk4":
        assert all(after < before for before, after in pairwise(slips))
    # A warm start may overshoot on the way.
    assert max(slips) == slips[0]
    # The mass is split by contacts: what slips slows down by a share of some percent a step.
    assert slips[-1] < 0.05 * slips[0]


@pytest.mark.parametrize(
    ("integrator", "expected"), [("semi_implicit_euler", 2.0), ("velocity_verlet", 2.0), ("rk4", 4.0)]
)
def test_implicit_friction_has_the_order_of_the_method(integrator: str, expected: float) -> None:
    """Below v_lim: u = v/v_lim falls by du/dt = -(mu g/v_lim)(2 u - u^2)."""
    start, time, rate = 0.8, 1.0, MU * G / LIMIT
    decayed = start / (2.0 - start) * math.exp(-2.0 * time)
    numbers, errors = [6, 12, 24, 48], []
    for n in numbers:
        state = resting(integrator, [(0.0, 0.0)], MU, "implicit")
        state.world.bottles.vx[0], state.world.bottles.vy[0] = start * LIMIT, 0.0
        advance(integrator, state.world, n, time / rate / n)
        errors.append(abs(float(state.world.bottles.vx[0]) / LIMIT - 2.0 * decayed / (1.0 + decayed)))
    assert order(numbers, errors) == pytest.approx(expected, abs=0.25)

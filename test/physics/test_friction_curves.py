# SPDX-License-Identifier: Apache-2.0
"""Friction by the arctangent, and solved implicitly: on a belt, at a rail, and between bottles that press each other.

With the slip s on a belt, explicit: ds/dt = -mu g p(s); implicit: s' + dt mu g p(s') = s in every step.
"""

import math

import numpy as np
import pytest
from scenes import MASS, NO_FLOOR, RADIUS, base, belt, bottle, contact, segment, simulation, stiffness_for
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from conveyor_sim.simulation import Simulation

MU, G, SLIP_LIMIT, SPEED = 0.4, 9.81, 0.02, 0.3


def p(slip: float, curve: str) -> float:
    """Share of full friction at a slip >= 0."""
    u = slip / SLIP_LIMIT
    return 2.0 / math.pi * math.atan(math.pi * u) if curve == "atan" else min(u, 1.0) * (2.0 - min(u, 1.0))


def set_down(curve: str, solver: str, tick: float, steps: int, integrator: str = "semi_implicit_euler") -> Simulation:
    """A bottle at rest on a belt at SPEED."""
    return simulation(
        tick=tick,
        accuracy={"per_tick": steps, "integrator": integrator},
        gravity=G,
        slip_limit=SLIP_LIMIT,
        friction_curve=curve,
        friction_solver=solver,
        base=base(MU),
        belts={"belt": belt(SPEED)},
        bottles=[bottle(0.0, 0.0)],
    )


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet"])
def test_set_down_with_the_arctangent(integrator: str) -> None:
    """Against the equation of motion integrated; the slip dies out slower than the polynomial's."""
    sim = set_down("atan", "explicit", 0.005, 200, integrator)
    path = solve_ivp(
        lambda t, s: [-MU * G * p(s[0], "atan")], (0.0, 0.2), [SPEED], rtol=1e-10, atol=1e-14, dense_output=True
    )
    for _ in range(40):
        sim.advance()
        # Off by one step of the pull at most.
        assert SPEED - sim.bottles().vx[0] == pytest.approx(path.sol(sim.time)[0], abs=MU * G * sim.model.dt)


@pytest.mark.parametrize("curve", ["polynomial", "atan"])
@pytest.mark.parametrize("steepness", [0.1, 3.0, 50.0])
def test_an_implicit_set_down_never_chatters(curve: str, steepness: float) -> None:
    """Step by step to rounding, at up to 50 times v_lim/(mu g), twice the bound of explicit friction.

    The force is that of the slip after half a step, in steps above v_lim/(mu g) later, so that the slip never reverses.
    """
    dt = round(steepness * SLIP_LIMIT / (MU * G), 9)
    sim = set_down(curve, "implicit", dt, 1)
    slip, lead = SPEED, max(0.5, 1.0 - 0.5 / steepness)
    for _ in range(max(10, round(3.0 / steepness))):
        sim.advance()
        ahead = brentq(lambda s, before=slip: s + lead * dt * MU * G * p(s, curve) - before, 0.0, slip, xtol=1e-18)
        slip -= dt * MU * G * p(ahead, curve)
        assert slip > -1e-15
        slip = max(0.0, slip)
        # Newton's rounds on the arctangent leave 1e-11 of v_lim, times the steepness in the velocity.
        assert SPEED - sim.bottles().vx[0] == pytest.approx(slip, rel=1e-9, abs=1e-7 * SLIP_LIMIT)


@pytest.mark.parametrize("curve", ["polynomial", "atan"])
@pytest.mark.parametrize(("solver", "order"), [("explicit", 1), ("implicit", 2)])
def test_order_of_both_solvers(solver: str, order: int, curve: str) -> None:
    """Against the equation of motion integrated: the implicit force is that in the middle of a step."""
    exact = solve_ivp(lambda t, s: [-MU * G * p(s[0], curve)], (0.0, 0.09), [SPEED], rtol=1e-12, atol=1e-15).y[0, -1]
    errors = []
    for steps in (100, 200, 400):
        sim = set_down(curve, solver, 0.09, steps)
        sim.advance()
        errors.append(abs(SPEED - sim.bottles().vx[0] - exact))
    assert math.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("curve", ["polynomial", "atan"])
def test_implicit_friction_sticks_at_a_rail_in_twenty_steps(curve: str) -> None:
    """A hoop that sticks in an impact leaves with half its tangential speed (test_oblique_impact.py).

    v_lim is 1 mm/s: explicit friction would need 8 pi mu v_n / v_lim = 4000 steps a contact.
    """
    contact_time, v_n, mu, limit = 0.001, 0.8, 0.2, 0.001
    v_t = 0.8 * 2.0 * mu * 2.0 * v_n
    sim = simulation(
        tick=contact_time,
        accuracy={"per_tick": 20},
        slip_limit=limit,
        friction_curve=curve,
        friction_solver="implicit",
        lever_arm="radius",
        # As good as undamped, with the kernels of the next test.
        contacts=[contact(stiffness_for(contact_time, MASS), "steel", ("normal", 1e-9), mu)],
        rails={"rail": segment((-5.0, 0.0), (5.0, 0.0))},
        bottles=[bottle(0.0, RADIUS + 0.1 * v_n * contact_time, v_t, -v_n)],
        **NO_FLOOR,
    )
    sim.advance(2)
    state = sim.bottles()
    slip = state.vx[0] + RADIUS * state.omega[0]
    # A residue of the slip stays, because the last steps press little and start from the friction of harder ones.
    assert 0.0 <= slip < 0.02 * v_t
    assert state.vx[0] == pytest.approx((v_t + slip) / 2.0, rel=1e-9)


@pytest.mark.parametrize("curve", ["polynomial", "atan"])
@pytest.mark.parametrize("solver", ["implicit", "explicit"])
def test_implicit_friction_is_stable_with_many_contacts(solver: str, curve: str) -> None:
    """A bottle that spins between six rails that press it: with implicit friction its spin dies out.

    Each contact alone would stop the slip within a step, six together would turn it round and make it grow: the mass is
    split by closed contacts. At this step explicit friction chatters at its full force for ever.
    """
    mu, press, stiffness, dt, limit = 0.3, 20e-6, 1e6, 1e-4, 0.001
    half = 0.02
    rails = {}
    for k in range(6):
        c, s = math.cos(k * math.pi / 3.0), math.sin(k * math.pi / 3.0)
        rails[f"rail_{k}"] = segment(
            (RADIUS * c - half * s, RADIUS * s + half * c), (RADIUS * c + half * s, RADIUS * s - half * c)
        )
    sim = simulation(
        tick=dt,
        accuracy={"per_tick": 1},
        slip_limit=limit,
        friction_curve=curve,
        friction_solver=solver,
        contacts=[contact(stiffness, "steel", ("normal", 200.0), mu)],
        rails=rails,
        bottles=[bottle(0.0, 0.0, spin=20.0 * limit / RADIUS)],
        **NO_FLOOR,
    )
    # No scene may begin with an overlap: it swells between rails that it touched.
    sim._state.world.bottles.radius[0] += press
    spins = []
    for _ in range(400):
        sim.advance()
        spins.append(RADIUS * sim.bottles().omega[0])
    assert sim.contacts().kind.size == 6
    if solver == "implicit":
        # It may overshoot, because the contacts start from the friction of the last step.
        assert np.abs(spins).max() < 20.0 * limit
        assert np.abs(spins[-20:]).max() < 1e-6 * limit
    else:
        assert np.abs(spins[-20:]).max() > limit

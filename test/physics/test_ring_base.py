# SPDX-License-Identifier: Apache-2.0
"""A bottle whose base is a ring: spin and slide share the friction (test/engine/test_ring.py has the law itself).

Spin alone, u = |omega| R_b, eps = v_lim / 2, A = mu m g R_b^2 / J: du/dt = -A u / sqrt(u^2 + eps^2), so
    A t = f(u_0) - f(u),   f(u) = sqrt(u^2 + eps^2) - eps asinh(eps / u).
"""

import math
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, simulation
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from conveyor_sim.simulation import Simulation

MU, G, SLIP_LIMIT = 0.4, 9.81, 0.01
RING = 0.05
INERTIA = MASS * RADIUS**2
EPS = 0.5 * SLIP_LIMIT
A = MU * MASS * G * RING**2 / INERTIA
INTEGRATORS = ["semi_implicit_euler", "velocity_verlet"]
LEDGER = {"energy_ledger": "on"}
SPARE: dict[str, Any] = {
    "spare_belt": belt(0.0, (8.0, 8.0), 0.1, 0.1),
    "spare_bend": {
        "kind": "curved", "centre": [9.0, 9.0], "inner_radius": 0.1, "width": 0.1, "start_angle": 0.0, "span": 1.0,
        "material": "chain", "speed": 0.0,
    },
}  # fmt: skip
"""Belts where no bottle is: with them, and a ledger, rings have the kernels of those in test_energy_ledger.py."""


def standing(belts: dict[str, Any], bottles: list[Any], ring: float | None = RING, **fields: Any) -> Simulation:
    """Bottles on ring bases; 200 steps to a tick of 10 ms."""
    given = {"accuracy": {"per_tick": 200}, "gravity": G, "slip_limit": SLIP_LIMIT, "base": base(MU), "belts": belts}
    if ring is not None:
        given |= {"bottle_types": {"bottle": kind(base_radius=ring)}, "belts": {**belts, **SPARE}, "effects": LEDGER}
    return simulation(**{**given, **fields}, bottles=bottles)


def f(u: float) -> float:
    return math.hypot(u, EPS) - EPS * math.asinh(EPS / u)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("spin", [6.0, -6.0])
def test_spin_at_rest_dies_out_by_the_closed_form(spin: float, integrator: str) -> None:
    """At a constant rate mu m g R_b / J, then the last v_lim of it; without any motion of the axis."""
    sim = standing(
        {"belt": belt(0.0)}, [bottle(0.3, 0.2, spin=spin)], accuracy={"per_tick": 200, "integrator": integrator}
    )
    start = abs(spin) * RING
    dt = sim.model.dt
    for _ in range(20):
        sim.advance()
        left = f(start) - A * sim.time
        # Down to a rim speed of 1e-9 of the limit, where f is -70 eps.
        expected = (
            brentq(lambda u, left=left: f(u) - left, 1e-12 * EPS, start, xtol=1e-18) if left > f(1e-9 * EPS) else 0
        )
        assert math.copysign(1.0, spin) * sim.bottles().omega[0] * RING == pytest.approx(expected, abs=A * dt)
    assert abs(sim.bottles().omega[0]) * RING < 1e-3 * SLIP_LIMIT
    assert (sim.bottles().x[0], sim.bottles().y[0]) == (0.3, 0.2)


def test_on_a_point_it_spins_for_ever() -> None:
    """The paper's base."""
    sim = standing({"belt": belt(0.0)}, [bottle(0.0, 0.0, spin=6.0)], ring=None)
    sim.advance(100)
    assert sim.bottles().omega[0] == 6.0


def drag(vx: float, vy: float, omega: float, across: float = 0.0, speeds: tuple[float, float] = (0.0, 0.0)) -> Any:
    """Acceleration (m/s^2, m/s^2, rad/s^2) by quadrature, with an edge along x at -across between two belts."""
    angle = 2.0 * np.pi * (np.arange(4096) + 0.5) / 4096
    under = np.where(RING * np.sin(angle) + across >= 0.0, speeds[1], speeds[0])
    x, y = vx - omega * RING * np.sin(angle) - under, vy + omega * RING * np.cos(angle)
    pull = -MU * G / np.sqrt(x**2 + y**2 + EPS**2)
    moment = RING * (np.cos(angle) * pull * y - np.sin(angle) * pull * x)
    return np.array([(pull * x).mean(), (pull * y).mean(), moment.mean() * MASS / INERTIA])


def test_slide_and_spin_die_out_together() -> None:
    """Set down on a belt while it spins, against the equations of motion: its spin lasts longer than it would alone."""
    speed, spin = 0.5, 9.0
    sim = standing({"belt": belt(speed)}, [bottle(0.0, 0.0, spin=spin)])
    path = solve_ivp(lambda t, u: drag(u[0] - speed, u[1], u[2]), (0.0, 0.3), [0.0, 0.0, spin], rtol=1e-9, atol=1e-12,
                     dense_output=True)  # fmt: skip
    alone = spin * RING / A
    for _ in range(30):
        sim.advance()
        state = sim.bottles()
        vx, vy, omega = path.sol(sim.time)
        # Off by a step of the pull at most.
        assert state.vx[0] == pytest.approx(vx, abs=MU * G * sim.model.dt)
        assert state.vy[0] == pytest.approx(vy, abs=1e-9)
        assert state.omega[0] == pytest.approx(omega, abs=A / RING * sim.model.dt)
        if sim.time < alone <= sim.time + 0.01:
            assert state.omega[0] > 0.05 * spin
    assert abs(sim.bottles().omega[0]) < 1e-3 * spin


def test_a_spinning_bottle_is_easier_to_move() -> None:
    """Against a slide much slower than the spin a ring resists with half of s_v / s_w only; a point with mu m g."""
    rims, slide = 1.0, 0.05
    ring = standing({"belt": belt(slide)}, [bottle(0.0, 0.0, spin=rims / RING)])
    point = standing({"belt": belt(slide)}, [bottle(0.0, 0.0, spin=rims / RING)], ring=None)
    ring.advance()
    point.advance()
    assert ring.bottles().vx[0] == pytest.approx(MU * G * 0.5 * slide / rims * 0.01, rel=0.05)
    assert point.bottles().vx[0] == pytest.approx(MU * G * 0.01, rel=0.05)


TWO_BELTS = {"lower": belt(-0.4, (-5.0, -5.0), 10.0, 5.0), "upper": belt(0.4, (-5.0, 0.0), 10.0, 5.0)}


def test_opposite_belts_spin_a_ring_that_straddles_them() -> None:
    """It starts with alpha = -(2/pi) mu m g R_b / J, speeds up towards the belts', and stays where it is."""
    sim = standing(TWO_BELTS, [bottle(0.1, 0.0)])
    sim.advance()
    start = -2.0 / math.pi * MU * MASS * G * RING / INERTIA * 0.01
    # 32 points, the edge between them found: 2 % of mu m g R_b at most.
    assert sim.bottles().omega[0] == pytest.approx(start, rel=0.03)
    path = solve_ivp(lambda t, u: drag(0.0, 0.0, u[0], 0.0, (-0.4, 0.4))[2:], (0.0, 0.5), [0.0], rtol=1e-6, atol=1e-9)
    sim.advance(49)
    state = sim.bottles()
    assert state.omega[0] == pytest.approx(path.y[0, -1], rel=0.02)
    assert abs(state.x[0] - 0.1) < 2e-3
    assert abs(state.y[0]) < 2e-3


def test_on_a_point_only_one_of_two_belts_carries() -> None:
    """The paper's base has no edge under it."""
    sim = standing(TWO_BELTS, [bottle(0.1, 0.0)], ring=None)
    sim.advance(30)
    state = sim.bottles()
    assert state.vx[0] == pytest.approx(0.4, abs=1e-3)
    assert state.omega[0] == 0.0


@pytest.mark.parametrize("across", [-0.5, 0.3])
def test_a_ring_partly_over_goes_with_both(across: float) -> None:
    """Off the middle it is pulled along by the belt that has more of it, and turns: against the equations of motion."""
    sim = standing(TWO_BELTS, [bottle(0.0, across * RING)])
    path = solve_ivp(
        lambda t, u: [u[2], *drag(u[1], u[2], u[3], u[0], (-0.4, 0.4))], (0.0, 0.1), [across * RING, 0.0, 0.0, 0.0],
        rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    sim.advance(10)
    state = sim.bottles()
    # 2 % of mu g and of mu m g R_b / J at most, over the time.
    assert state.vx[0] == pytest.approx(path.y[1, -1], abs=0.02 * MU * G * sim.time)
    assert state.omega[0] == pytest.approx(path.y[3, -1], abs=0.02 * A / RING * sim.time)


def test_from_one_belt_to_the_next() -> None:
    """Slid across an edge it passes from one belt's speed to the other's, and stops spinning there."""
    sim = standing(TWO_BELTS, [bottle(0.0, -2.0 * RING, -0.4, 1.0)])
    sim.advance(200)
    state = sim.bottles()
    assert state.y[0] > RING
    assert state.vx[0] == pytest.approx(0.4, abs=1e-6)
    assert state.omega[0] == pytest.approx(0.0, abs=1e-6)
    assert state.belt[0] == 1


def test_on_a_turning_belt_it_turns_with_it() -> None:
    """The spin of the belt's field is the spin that a ring comes to, on a point it never does."""
    table = {
        "kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.0, "width": 1.0, "start_angle": 0.0,
        "span": 2.0 * math.pi, "material": "chain", "speed": 0.5, "speed_limits": [-9, 9],
    }  # fmt: skip
    sim = standing({"table": table}, [bottle(0.3, 0.0, 0.0, 0.3)])
    sim.advance(100)
    # Omega = speed at the centre line, 0.5 m, over its radius. The creep outward takes a little of it, of order s / u.
    assert sim.bottles().omega[0] == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("gap", [0.001, 0.02, 0.049])
def test_a_belt_that_only_the_rim_reaches_drags_it(gap: float) -> None:
    """The axis stands beside the belt, on a floor without friction, up to a base radius away."""
    sim = standing({"belt": belt(1.0, (-5.0, 0.0), 10.0, 0.5)}, [bottle(0.0, -gap)], floor={"friction": 0.0})
    sim.advance()
    assert sim.bottles().vx[0] > 0.0
    beyond = standing({"belt": belt(1.0, (-5.0, 0.0), 10.0, 0.5)}, [bottle(0.0, -0.0501)], floor={"friction": 0.0})
    beyond.advance()
    assert beyond.bottles().vx[0] == 0.0


@pytest.mark.parametrize("fields", [{}, {"friction_curve": "atan"}, {"friction_solver": "implicit"}])
def test_a_point_stays_a_point_beside_rings(fields: dict[str, Any]) -> None:
    """Bits are the same as without rings, on and off the belt's edge."""
    points = [bottle(-1.0, -0.01, 0.3, 0.02), bottle(1.0, 0.2, 0.1, 0.0)]
    belts = {"belt": belt(0.5, (-5.0, 0.0), 10.0, 0.5)}
    # They never meet.
    fields = {**fields, "contacts": [contact(5000.0)], "effects": {"bottle_contact": "off"}}
    alone = standing(belts, points, ring=None, **fields)
    types = {"bottle": kind(), "ring": kind(base_radius=RING)}
    more = {**fields, "bottle_types": types, "effects": {**fields["effects"], **LEDGER}}
    beside = standing(belts, [*points, bottle(3.0, 0.2, type="ring")], **more)
    for _ in range(30):
        alone.advance()
        beside.advance()
        np.testing.assert_array_equal(beside.bottles().vx[:2], alone.bottles().vx)
        np.testing.assert_array_equal(beside.bottles().vy[:2], alone.bottles().vy)

# SPDX-License-Identifier: Apache-2.0
"""The method of impulses against closed forms: impacts, friction, queues, creep; stable at any stiffness."""

import math

import numpy as np
import pytest
from scenes import MASS, RADIUS, arc, base, belt, bottle, kind, segment
from scipy.integrate import solve_ivp
from swept import MU_BASE, G, crowd, file_of, forces_on, glass, kinetic, run

from conveyor_sim.physics.laws.rebounds import peak_factor

NO_BELT = {"base": base(MU_BASE)}


@pytest.mark.parametrize("restitution", [0.0001, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("stiffness", [1e4, 1e8])
def test_a_head_on_impact_rebounds_with_e(restitution: float, stiffness: float) -> None:
    """Also of unequal bottles: momentum is conserved, and the relative speed is e times that before."""
    sim = run(
        contacts=[glass(stiffness=stiffness, restitution=restitution), glass("steel")],
        bottles=[bottle(0.0, 0.0, 0.7), bottle(0.2, 0.0, -0.2, type="big"), bottle(3.0, 0.0)],
    )
    sim.advance(30)
    vx = sim.bottles().vx
    assert MASS * vx[0] + 0.4 * vx[1] == pytest.approx(MASS * 0.7 - 0.4 * 0.2, abs=1e-15)
    assert vx[1] - vx[0] == pytest.approx(restitution * 0.9, abs=1e-14)


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.3, 0.49, 0.6, 1.2])
def test_the_peak_of_an_impact_is_that_of_the_damped_oscillation(zeta: float) -> None:
    """k delta + c v over v sqrt(k m_r), against the motion integrated in steps of 1e-4 / w."""
    path = solve_ivp(lambda t, u: [u[1], -u[0] - 2.0 * zeta * u[1]], (0.0, 4.0), [0.0, 1.0], max_step=1e-3, rtol=1e-9)
    assert peak_factor(zeta) == pytest.approx(float((path.y[0] + 2.0 * zeta * path.y[1]).max()), rel=1e-5)


def test_the_peak_force_of_an_impact_is_reported() -> None:
    """v sqrt(k m_r) times the factor of the damping ratio that belongs to e = 0.5."""
    sim = run(bottles=[bottle(0.0, 0.0, 0.5), bottle(0.2, 0.0)])
    sim.advance(30)
    law = sim.model.pair_law
    assert law is not None and law.stiffness is not None and law.damping_normal is not None
    root = math.sqrt(1e8 * 0.5 * MASS)
    zeta = law.damping_normal[0] / (2.0 * root)
    assert sim.peak_force == pytest.approx(0.5 * root * peak_factor(zeta), rel=1e-12)


@pytest.mark.parametrize("v_t", [0.1, 1.5])
def test_an_oblique_impact_on_a_rail_sticks_or_slides(v_t: float) -> None:
    """A hoop loses half of a small tangential speed, and 2 mu (1 + e) v_n of the slip at a large one."""
    v_n, mu = 0.8, 0.2
    sim = run(
        slip_limit=1e-6,
        contacts=[glass(), glass("steel", friction=mu)],
        rails={"rail": segment((-5.0, 0.0), (5.0, 0.0))},
        bottles=[bottle(0.0, RADIUS + 0.01, v_t, -v_n)],
    )
    sim.advance(4)
    state = sim.bottles()
    lost = min(0.5 * v_t, mu * 1.5 * v_n)
    assert state.vy[0] == pytest.approx(0.5 * v_n, rel=1e-12)
    assert state.vx[0] == pytest.approx(v_t - lost, rel=1e-4)
    assert abs(state.omega[0]) * RADIUS == pytest.approx(lost, rel=1e-4)


def test_impacts_on_an_arc_rebound_along_its_normal() -> None:
    """From inside, at 45 degrees: without friction the tangential speed stays."""
    sim = run(
        contacts=[glass(), glass("steel", friction=0.0)],
        rails={"bowl": arc((0.0, 0.0), 0.5, -math.pi, 2.0)},
        bottles=[bottle(0.0, 0.0, 0.0, -1.0)],
    )
    sim.advance(60)
    state = sim.bottles()
    assert (state.vx[0], state.vy[0]) == pytest.approx((0.0, 0.5), abs=1e-9)


def test_a_bottle_slides_to_rest() -> None:
    """After v^2 / (2 mu g), less half a step's way, because a step moves with the velocity at its end."""
    sim = run(floor={"friction": 0.3}, bottles=[bottle(0.0, 0.0, 1.0)])
    sim.advance(100)
    state = sim.bottles()
    way = 1.0 / (2.0 * 0.3 * G) - 0.5 * sim.model.dt
    assert state.x[0] == pytest.approx(way, rel=2e-4)
    assert abs(state.vx[0]) < 1e-12


def test_a_file_presses_on_a_stop_with_mu_m_g_of_each_bottle() -> None:
    """Closed form: the belt drags each bottle with mu m g, and the contacts carry the sum."""
    count = 20
    sim = run(16, 2, **file_of(count))
    sim.advance(400)
    assert forces_on(sim, "stop") == pytest.approx(count * MU_BASE * MASS * G, rel=2e-3)
    contacts = sim.contacts()
    pairs = contacts.kind == 0
    behind = np.sort(contacts.normal_force[pairs])
    expected = np.arange(1, count) * MU_BASE * MASS * G
    assert behind == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_a_slow_belt_drags_with_its_friction_curve(share: float) -> None:
    """mu m g (2 s - s^2) of each bottle on a belt at the share s of the slip limit, in steps of any length."""
    for steps in (2, 16):
        sim = run(steps, 2, slip_limit=0.3 / share, **file_of(3))
        sim.advance(300)
        expected = 3.0 * MU_BASE * MASS * G * (2.0 * share - share**2)
        assert forces_on(sim, "stop") == pytest.approx(expected, rel=1e-3)


def test_a_crowd_rests_with_the_sum_of_its_drags_on_the_end_wall() -> None:
    sim = run(16, 2, **{name: value for name, value in crowd(6, 5).items() if name in ("belts", "rails", "bottles")})
    sim.advance(600)
    state = sim.bottles()
    weight = float(sim.model.type_mass[state.type].sum()) * G
    contacts = sim.contacts()
    walls = list(sim.model.rails).index("walls")
    on_wall = (contacts.kind == 1) & (contacts.b == walls)
    along = float((contacts.normal_force * contacts.nx + contacts.tangential_force * contacts.ny)[on_wall].sum())
    assert along == pytest.approx(MU_BASE * weight, rel=0.02)
    assert sim.integration.deepest_overlap * RADIUS < 3e-4


def test_a_bottle_on_a_turntable_creeps_outward() -> None:
    """At v_lim (1 - sqrt(1 - Omega^2 r / (mu g))), as in test_turntable.py."""
    radius, share, limit = 0.5, 0.5, 0.01
    omega = math.sqrt(share * MU_BASE * G / radius)
    table = {"kind": "curved", "centre": [0.3, -0.2], "inner_radius": 0.0, "width": 1.0, "start_angle": 1.0,
             "span": 2.0 * math.pi, "material": "chain", "speed": 0.5 * omega, "speed_limits": [-9, 9]}  # fmt: skip
    sim = run(belts={"table": table}, bottles=[bottle(0.3 + radius, -0.2, 0.0, omega * radius)])

    def distance() -> float:
        state = sim.bottles()
        return math.hypot(state.x[0] - 0.3, state.y[0] + 0.2)

    sim.advance(50)
    start = distance()
    sim.advance(400)

    def rate(t: float, r: list[float]) -> list[float]:
        return [limit * (1.0 - math.sqrt(1.0 - omega**2 * r[0] / (MU_BASE * G)))]

    expected = solve_ivp(rate, (0.0, 4.0), [start], rtol=1e-10).y[0, -1] - start
    coriolis = (2.0 * limit / (omega * radius)) ** 2
    assert distance() - start == pytest.approx(expected, rel=2.0 * coriolis + 1e-3)


@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e7, 1e9])
@pytest.mark.parametrize("sweeps", [1, 2])
def test_a_crowd_is_stable_at_any_stiffness(stiffness: float, sweeps: int) -> None:
    """It comes to rest on a moving belt, up to creep, without overlaps beyond those of its springs.

    The last bottles come to rest after 4 to 5.5 s, depending on the order in which pairs are solved.
    """
    given = crowd(6, 5, contacts=[glass(stiffness=stiffness), glass("steel", 2.0 * stiffness)])
    sim = run(8, sweeps, **{name: given[name] for name in ("belts", "rails", "bottles", "contacts")})
    sim.advance(600)
    load = 6 * 0.4 * MU_BASE * G
    assert sim.integration.shortened_ticks == 0
    assert sim.integration.deepest_overlap * RADIUS < 8.0 * load / stiffness + 1e-3
    mass = float(sim.model.type_mass[sim.bottles().type].sum())
    assert kinetic(sim) < 0.5 * mass * sim.model.settings.slip_limit**2


def test_energy_never_grows_without_a_belt() -> None:
    """Thirty bottles meet on a frictionless floor; each tick has at most the energy of the one before."""
    given = crowd(6, 5)
    sim = run(4, 1, belts={}, rails=given["rails"], bottles=given["bottles"], floor={"friction": 0.0})
    before = kinetic(sim)
    for _ in range(300):
        sim.advance(1)
        now = kinetic(sim)
        assert now <= before * (1.0 + 1e-12)
        before = now


def test_bottles_of_other_masses_press_with_the_sum() -> None:
    """A heavy bottle behind a light one, 20 : 1, both of their own radius."""
    sim = run(
        16,
        4,
        bottle_types={"bottle": kind(), "big": kind(0.08, 4.0)},
        belts={"belt": belt(0.2, (-2.0, -1.0), 3.0, 2.0)},
        rails={"stop": segment((0.0, -0.5), (0.0, 0.5))},
        bottles=[bottle(-0.066, 0.0), bottle(-0.22, 0.0, type="big")],
    )
    sim.advance(300)
    assert forces_on(sim, "stop") == pytest.approx(4.2 * MU_BASE * G, rel=1e-3)

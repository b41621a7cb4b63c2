# SPDX-License-Identifier: Apache-2.0
"""A bottle on a turn-table (a curved belt of a full turn): friction must hold it on its circle, Omega^2 r < mu g.

The regularised law holds only with slip, so the bottle creeps outward at s with mu g p(s) = Omega^2 r:
    dr/dt = v_lim (1 - sqrt(1 - Omega^2 r / (mu g)))
Coriolis turns the slip by 2 s / (Omega r), which changes the rate by that squared.
"""

import math

import pytest
from scenes import base, bottle, simulation
from scipy.integrate import solve_ivp

from conveyor_sim.simulation import Simulation

MU, G, SLIP_LIMIT = 0.4, 9.81, 0.01
TABLE = 1.0
"""m, radius of the table."""
CENTRE = (0.3, -0.2)


def turntable(
    omega: float, radius: float, inner: float = 0.0, steps: int = 50, integrator: str = "velocity_verlet"
) -> Simulation:
    """A bottle that turns with a table at `omega` (rad/s), `radius` (m) away from its centre."""
    width = TABLE - inner
    return simulation(
        tick=0.01,
        accuracy={"per_tick": steps, "integrator": integrator},
        gravity=G,
        slip_limit=SLIP_LIMIT,
        base=base(MU),
        belts={
            "table": {
                "kind": "curved", "centre": CENTRE, "inner_radius": inner, "width": width, "start_angle": 1.0,
                "span": 2.0 * math.pi, "material": "chain",
                "speed": omega * (inner + width / 2), "speed_limits": [-9, 9],
            }
        },
        floor={"friction": 0.0},
        bottles=[bottle(CENTRE[0] + radius, CENTRE[1], 0.0, omega * radius)],
    )  # fmt: skip


def distance(sim: Simulation) -> float:
    state = sim.bottles()
    return math.hypot(state.x[0] - CENTRE[0], state.y[0] - CENTRE[1])


@pytest.mark.parametrize("inner", [0.0, 0.2], ids=["disc", "ring"])
@pytest.mark.parametrize("share", [0.2, 0.5, -0.8])
def test_it_creeps_outward(share: float, inner: float) -> None:
    """`share` = Omega^2 r / (mu g), its sign that of Omega; after the slip has set in, against the rate integrated."""
    radius = 0.5
    omega = math.copysign(math.sqrt(abs(share) * MU * G / radius), share)
    sim = turntable(omega, radius, inner)
    sim.advance(50)
    start, duration = distance(sim), 4.0
    sim.advance(round(duration / 0.01))

    def rate(t: float, r: list[float]) -> list[float]:
        return [SLIP_LIMIT * (1.0 - math.sqrt(1.0 - omega**2 * r[0] / (MU * G)))]

    expected = solve_ivp(rate, (0.0, duration), [start], rtol=1e-10).y[0, -1] - start
    coriolis = (2.0 * SLIP_LIMIT / (abs(omega) * radius)) ** 2
    assert distance(sim) - start == pytest.approx(expected, rel=2.0 * coriolis + 1e-3)


@pytest.mark.parametrize("steps", [8, 40, 200])
def test_semi_implicit_euler_creeps_less_by_half_a_step_of_the_pull(steps: int) -> None:
    """Its velocity lags by half a step on the circle, which looks like a slip outward of Omega^2 r dt / 2.

    At the bound of stability, dt = v_lim / (mu g), that is f v_lim / 2 with f = Omega^2 r / (mu g): most of the creep.
    """
    radius, share = 0.5, 0.5
    omega = math.sqrt(share * MU * G / radius)
    sim = turntable(omega, radius, steps=steps, integrator="semi_implicit_euler")
    sim.advance(50)
    start = distance(sim)
    sim.advance(100)
    creep = SLIP_LIMIT * (1.0 - math.sqrt(1.0 - share))
    lag = omega**2 * radius * sim.model.dt / 2.0
    # Meanwhile r grows by 0.6 %, and the creep with it.
    assert distance(sim) - start == pytest.approx(creep - lag, rel=0.02)


@pytest.mark.parametrize("steps", [8, 40, 200])
def test_leapfrog_creeps_as_much_at_any_step(steps: int) -> None:
    """It asks the belt for its velocity where the bottle was when it had its own."""
    radius, share = 0.5, 0.5
    omega = math.sqrt(share * MU * G / radius)
    coarse, fine = (
        turntable(omega, radius, steps=n, integrator=name) for n, name in ((steps, "leapfrog"), (400, "rk4"))
    )
    gone = []
    for sim in (coarse, fine):
        sim.advance(50)
        start = distance(sim)
        sim.advance(100)
        gone.append(distance(sim) - start)
    assert gone[0] == pytest.approx(gone[1], rel=1e-4)


@pytest.mark.parametrize("steps", [2, 3, 4, 40])
@pytest.mark.parametrize("integrator", ["leapfrog", "semi_implicit_euler", "velocity_verlet"])
def test_creep_with_implicit_friction_is_predicted(integrator: str, steps: int) -> None:
    """Within a factor of two: none, but for velocity Verlet with less than a step per v_lim / (mu g), 4 in a tick."""
    radius, share = 0.5, 0.5
    omega = math.sqrt(share * MU * G / radius)
    implicit = turntable(omega, radius, steps=steps, integrator=integrator).scene
    sims = [
        turntable(omega, radius, steps=400, integrator="leapfrog"),
        Simulation(implicit.model_copy(update={"friction_solver": "implicit"}), threads=1),
    ]
    gone = []
    for sim in sims:
        sim.advance(50)
        start = distance(sim)
        sim.advance(100)
        gone.append(distance(sim) - start)
    predicted = sum(term.value for term in sims[1].model.prediction.terms if term.quantity == "creep on curved belts")
    assert (predicted > 0.0) == (integrator == "velocity_verlet" and steps < 4)
    error = abs(gone[1] / gone[0] - 1.0)
    assert 0.5 * predicted <= error <= 2.0 * predicted + 2e-4


def test_it_slides_away_beyond_mu_g_over_omega_squared() -> None:
    """Just inside the limit it stays within a creep of at most v_lim; just beyond it leaves, faster than v_lim."""
    omega = 2.5
    limit = MU * G / omega**2
    held, lost = turntable(omega, 0.95 * limit), turntable(omega, 1.02 * limit)
    held.advance(50)
    lost.advance(50)
    before = distance(held), distance(lost)
    held.advance(50)
    lost.advance(50)
    assert (distance(held) - before[0]) / 0.5 < SLIP_LIMIT
    assert (distance(lost) - before[1]) / 0.5 > SLIP_LIMIT
    lost.advance(200)
    assert distance(lost) > TABLE
    assert lost.bottles().belt[0] == -1


def test_the_speed_of_a_curved_belt_holds_at_its_centre_line() -> None:
    """A bottle set down at R + b/2 is brought to the belt's speed, counter-clockwise."""
    inner = 0.2
    middle = inner + (TABLE - inner) / 2
    sim = turntable(0.5, middle, inner)
    assert sim.belts().commanded[0] == pytest.approx(0.5 * middle)
    sim.advance(100)
    state = sim.bottles()
    turned = math.atan2(state.y[0] - CENTRE[1], state.x[0] - CENTRE[0])
    # It creeps and lags by 2 s / (Omega r) of the slip: within v_lim of the surface.
    assert turned == pytest.approx(0.5 * sim.time, abs=SLIP_LIMIT * sim.time / middle)
    assert math.hypot(state.vx[0], state.vy[0]) == pytest.approx(0.5 * middle, abs=SLIP_LIMIT)

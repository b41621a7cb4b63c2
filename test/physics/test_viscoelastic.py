# SPDX-License-Identifier: Apache-2.0
"""Viscoelastic damping on Hertz contacts: the impact integrated by another method, its series, its energy, its bits."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_contact_laws import CONTACT_TIME, SPEED, hertz_stiffness, impacts, rebound
from scenes import MASS, NO_FLOOR, RADIUS, bottle, every_law, scene, simulation
from scipy.integrate import solve_ivp

from conveyor_sim.engine.contact.laws.viscoelastic import restitution_at, strength_for, viscoelastic_damping
from conveyor_sim.engine.integrators import INTEGRATORS, SWEPT
from conveyor_sim.simulation import Simulation

REDUCED = MASS / 2.0
K = hertz_stiffness(CONTACT_TIME, SPEED, REDUCED)
SPEEDS = np.array([0.05, 0.2, 0.7, 3.0])


def law(e: float, speed: float = SPEED) -> dict[str, Any]:
    return {"hertz_stiffness": K, "damping": {"law": "viscoelastic", "restitution": e, "speed": speed}}


def integrated(c: float, speed: float, k: float = K, m: float = REDUCED) -> float:
    """e of N = max(0, k x^1.5 + c sqrt(x) x'), in SI units, until the force has gone."""

    def force(x: float, v: float) -> float:
        return k * max(x, 0.0) ** 1.5 + c * math.sqrt(max(x, 0.0)) * v

    def gone(_: float, y: Any) -> float:
        return y[0] * k + c * y[1] if y[1] < 0.0 else 1.0

    gone.terminal = True  # type: ignore[attr-defined]
    time = (m * m / (k * k * speed)) ** 0.2
    path = solve_ivp(
        lambda _, y: (y[1], -max(0.0, force(y[0], y[1])) / m),
        (0.0, 40.0 * time),
        (0.0, speed),
        "DOP853",
        events=gone,
        rtol=1e-10,
        atol=1e-13 * speed * time,
        max_step=0.02 * time,
    )
    assert path.t_events[0].size == 1
    return float(-path.y[1, -1] / speed)


@pytest.mark.parametrize("e", [0.999, 0.9, 0.6, 0.3, 0.1])
@pytest.mark.parametrize("speed", [0.02, 2.0])
def test_the_coefficient_has_the_restitution_at_its_speed(e: float, speed: float) -> None:
    """With other stiffness and mass, too."""
    for k, m in ((1e5, 0.3), (1e9, 0.1)):
        assert integrated(viscoelastic_damping(e, speed, k, m), speed, k, m) == pytest.approx(e, abs=1e-6)


@pytest.mark.parametrize("e", [1.0, 0.99999, 0.5, 0.01, 1e-9])
def test_strength_is_the_inverse(e: float) -> None:
    a = strength_for(e)
    assert e == 1.0 or restitution_at(a) == pytest.approx(e, rel=1e-9)
    assert (a == 0.0) == (e == 1.0)


def test_the_series_of_weak_damping() -> None:
    """1 - 1.15344 a + 0.79826 a^2 (Ramirez et al. 1999); an end without pull leaves a part of a^2.5 more."""
    for a in (1e-4, 1e-3, 1e-2):
        assert abs(restitution_at(a) - (1.0 - 1.15344 * a + 0.79826 * a * a)) < 2.0 * a**2.5 + 1e-5 * a


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name not in SWEPT])
@pytest.mark.parametrize("e", [0.4, 0.8])
def test_impacts_rebound_as_integrated(integrator: str, e: float) -> None:
    """By every integrator, at the reference speed and at others; the faster, the less is left."""
    sim = impacts(law(e), SPEEDS, 0.01, 4000, accuracy={"per_tick": 4000, "integrator": integrator})
    sim.advance(2)
    found = rebound(sim) / SPEEDS
    c = viscoelastic_damping(e, SPEED, K, REDUCED)
    assert sim.model.pair_law is not None
    assert sim.model.pair_law.damping_viscoelastic[0] == pytest.approx(c, rel=1e-12)
    # A method of first order is off by a part of c sqrt(delta) dt / m_r, 800 steps a contact.
    np.testing.assert_allclose(found, [integrated(c, speed) for speed in SPEEDS], atol=2e-3)
    assert found[2] == pytest.approx(e, abs=2e-3)
    assert (np.diff(found) < -0.02).all()


def test_loss_goes_with_the_fifth_root_of_the_speed() -> None:
    """1 - e = 1.15344 c v^0.2 m_r^-0.4 k^-0.6 at low speeds, less 0.6 of its square."""
    speeds = np.geomspace(1e-3, 1.0, 4)
    sim = impacts(law(0.98, 1.0), speeds, 0.01, 8000, accuracy={"per_tick": 8000, "integrator": "velocity_verlet"})
    sim.advance(2)
    lost = 1.0 - rebound(sim) / speeds
    c = viscoelastic_damping(0.98, 1.0, K, REDUCED)
    first = 1.15344 * c * speeds**0.2 * REDUCED**-0.4 * K**-0.6
    np.testing.assert_allclose(lost, first - 0.6 * first**2, rtol=5e-3)
    power = np.diff(np.log(lost + 0.6 * first**2)) / np.diff(np.log(speeds))
    np.testing.assert_allclose(power, 0.2, atol=1e-3)


def test_the_ledger_closes() -> None:
    """All lost energy is booked as damping."""
    e = 0.6
    sim = simulation(
        contacts=[{"between": ["glass", "glass"], **law(e)}],
        tick=0.01,
        accuracy={"per_tick": 4000, "integrator": "velocity_verlet"},
        bottles=[bottle(0.0, 0.0, SPEED), bottle(2.0 * RADIUS + 1e-4, 0.0)],
        effects={"energy_ledger": "on"},
        **NO_FLOOR,
    )
    sim.advance(2)
    ledger = sim.ledger()
    assert ledger is not None
    assert ledger.damping == pytest.approx(0.5 * REDUCED * SPEED**2 * (1.0 - e * e), rel=1e-3)
    assert ledger.contact_friction == pytest.approx(0.0, abs=1e-12)
    assert ledger.elastic == 0.0
    assert abs(ledger.residual) < 1e-5 * ledger.turnover


def test_the_bits_do_not_depend_on_the_threads() -> None:
    """A crowd that runs into itself."""
    draw = np.random.default_rng(5)
    crowd = scene(
        **every_law([{"between": ["glass", "glass"], **law(0.7)}]),
        tick=0.01,
        accuracy={"per_tick": 100},
        bottles=[
            bottle(2.05 * RADIUS * i, 2.05 * RADIUS * j, *draw.normal(0.0, 0.5, 2).tolist())
            for i in range(20)
            for j in range(20)
        ],
        **NO_FLOOR,
    )
    sims = [Simulation(crowd, threads) for threads in (1, 2)]
    before = sims[0].bottles().vx
    for sim in sims:
        sim.advance(10)
    assert np.count_nonzero(sims[0].bottles().vx != before) > 300
    assert sims[0].state_hash() == sims[1].state_hash()

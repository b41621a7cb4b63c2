# SPDX-License-Identifier: Apache-2.0
"""A single-file queue against a stop, on a belt that runs on below: the stop carries n mu m g."""

import numpy as np
import pytest
from scenes import MASS, PEAKS, RADIUS, base, belt, bottle, contact, segment, simulation

from conveyor_sim.simulation import Simulation

MU, G, N = 0.4, 9.81, 5
STIFFNESS = 50e3
PULL = MU * MASS * G
"""N, of the belt on one bottle: its slip stays above v_lim."""


def queue(damping: float, step: int = 200) -> Simulation:
    """N bottles in a row, touching each other and the stop."""
    return simulation(
        **PEAKS,
        tick=0.01,
        accuracy={"per_tick": step},
        gravity=G,
        base=base(MU),
        contacts=[contact(STIFFNESS, damping=("normal", damping)),
                  contact(STIFFNESS, "steel", damping=("normal", damping))],
        belts={"belt": belt(0.5)},
        rails={"stop": segment((0.0, -1.0), (0.0, 1.0))},
        bottles=[bottle(-RADIUS - 2.0 * RADIUS * i, 0.0) for i in range(N)],
    )  # fmt: skip


def impulse_of_stop(sim: Simulation) -> float:
    """Return the impulse of the stop so far, N s. A bottle's impulse is that of the contacts ahead of and behind it."""
    return float(np.sum(sim.bottles().impulse * (-1.0) ** np.arange(N)))


def test_the_stop_carries_n_mu_m_g_in_the_mean() -> None:
    """Momentum: what the belt gave and the stop did not take is in the bottles, to rounding; they only ring."""
    sim = queue(damping=1e-3)
    sim.advance(200)
    given = N * PULL * sim.time
    momentum = MASS * sim.bottles().vx.sum()
    assert given - impulse_of_stop(sim) == pytest.approx(momentum, abs=1e-9 * given)
    mean = impulse_of_stop(sim) / sim.time
    # Released with no load, each bottle oscillates about its place: at most a contact's m_r v is in motion.
    assert mean == pytest.approx(N * PULL, rel=5e-3)


def test_at_rest_every_contact_carries_the_bottles_behind_it() -> None:
    """Damped, the ringing dies out: the contact behind bottle i carries (n - i) mu m g."""
    sim = queue(damping=50.0)
    sim.advance(300)
    contacts = sim.contacts()
    pairs = contacts.kind == 0
    np.testing.assert_allclose(contacts.normal_force[~pairs], [N * PULL], rtol=1e-6)
    np.testing.assert_allclose(contacts.normal_force[pairs], PULL * np.arange(N - 1, 0, -1), rtol=1e-6)
    np.testing.assert_allclose(contacts.overlap * STIFFNESS, contacts.normal_force, rtol=1e-6)


def test_a_stopped_belt_lets_the_queue_relax() -> None:
    """The regularised law can't hold a static load: with the belt stopped, the springs push the bottles apart."""
    sim = queue(damping=50.0)
    sim.advance(100)
    sim.command(["belts/belt/cmd_speed"], [0.0])
    sim.advance(1000)
    assert sim.contacts().normal_force.max(initial=0.0) < 1e-3 * PULL

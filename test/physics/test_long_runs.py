# SPDX-License-Identifier: Apache-2.0
"""A thousand bounces without losses: the energy walks at random, by as much as the contacts' place in the steps tells.

A step begins somewhere in a contact, not at first touch. With a linear law, w = sqrt(k / m) and the fractions phi and
psi of a step at which a bottle touches and parts, semi-implicit Euler (and velocity Verlet, the same map of the speeds
between contacts) returns 1 + (w dt)^2 [psi (1 - psi) - phi (1 - phi)] of the energy. A contact lasts
n = pi / (2 asin(w dt / 2)) steps, so psi = n - phi modulo 1. With phases that are spread evenly, as they are between
walls a thousand steps apart, each bounce changes the energy by (w dt)^2 s (1 - s) / sqrt(3) rms, s the fraction of n.
"""

import math

import numpy as np
import pytest
from scenes import NO_FLOOR, bottle, contact, every_law, kind, phases, rms, simulation

LANES, BOUNCES = 150, 80
SPEED, RADIUS, MASS = 0.5, 0.03, 0.2
FLIGHT = 1500
"""Steps from wall to wall: phases are spread evenly from about 700 on. Below a hundred they lock, and nothing walks."""


def energies(steps: float, integrator: str) -> np.ndarray:
    """Energy of a bottle in each lane after BOUNCES, over that at the start, in contacts of `steps` steps.

    The walls are bottles as heavy as hills: so the kernels are those of all tests of one law.
    """
    angle = 2.0 * math.sin(math.pi / (2.0 * steps))
    dt = 1e-4
    stiffness = MASS * (angle / dt) ** 2
    way = FLIGHT * SPEED * dt
    apart = 2.0 * RADIUS + 0.5 * way
    rows = 0.1 * np.arange(LANES)
    wall, light = "hill", "bottle"
    sim = simulation(
        **every_law([contact(stiffness)], {light: kind(RADIUS, MASS), wall: kind(RADIUS, 1e15)}),
        tick=0.01,
        duration=1e4,
        accuracy={"per_tick": 100, "integrator": integrator},
        bottles=[
            bottle(x, y, vx, 0.0, type=type_)
            for y, phase in zip(rows, phases(LANES), strict=True)
            for type_, x, vx in ((light, 0.8 * (phase - 0.5) * way, SPEED), (wall, -apart, 0.0), (wall, apart, 0.0))
        ],
        **NO_FLOOR,
    )
    sim.advance(round(BOUNCES * (FLIGHT + steps) * dt / 0.01))
    state = sim.bottles()
    free = np.abs(state.x[::3]) < 0.5 * way
    assert sim.integration.shortened_ticks == 0
    assert free.sum() > 0.8 * LANES
    return (state.vx[::3][free] / SPEED) ** 2


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet"])
def test_energy_walks_at_random_by_the_places_of_contacts_in_steps(integrator: str) -> None:
    """The spread is that of the formula at n + 1/2 steps per contact. At whole steps psi mirrors phi: no spread."""
    steps = 20.5
    angle = 2.0 * math.sin(math.pi / (2.0 * steps))
    expected = angle**2 * math.sqrt(BOUNCES / 48.0)
    # The root mean square of a hundred and fifty walks is uncertain by 6 %.
    assert rms(energies(steps, integrator) - 1.0) == pytest.approx(expected, rel=0.25)
    assert rms(energies(20.0, integrator) - 1.0) < 0.1 * expected

# SPDX-License-Identifier: Apache-2.0
"""Newton's third law: a closed system (bottles only) keeps its momentum, and its angular momentum, to rounding."""

import math

import numpy as np
import pytest
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, every_law, kind, phases, simulation, stiffness_for

from conveyor_sim.simulation import Simulation

INTEGRATORS = ["semi_implicit_euler", "velocity_verlet"]
PARTNERS = {"bottle": (RADIUS, MASS, 1.0), "small": (0.04, 0.35, 0.5)}
"""Radius, mass, inertia / (m R^2)."""


def cloud(integrator: str, lever_arm: str = "overlap") -> Simulation:
    """Thirty bottles of two types that fly into each other: friction, both dampings, spin."""
    angle = 2.0 * math.pi * phases(30)
    distance = 0.25 + 0.025 * np.arange(30)
    inward = 1.0 + phases(30)
    return simulation(
        **every_law(
            [
                contact(5000.0, damping=("paper", 2.0), friction=0.3),
                contact(8000.0, "steel", damping=("normal", 3.0), friction=0.2),
                {"between": ["steel", "steel"], "stiffness": 3000.0, "friction": 0.5},
                *({"between": ["steel", other], "stiffness": 1000.0} for other in ("odd", "rare", "scarce")),
            ],
            {
                name: kind(radius, mass, "glass" if name == "bottle" else "steel", inertia=share * mass * radius**2)
                for name, (radius, mass, share) in PARTNERS.items()
            },
        ),
        tick=0.005,
        accuracy={"per_tick": 250, "integrator": integrator},
        lever_arm=lever_arm,
        bottles=[
            bottle(d * c, d * s, -v * c + 0.3, -v * s - 0.1, type=name, spin=5.0 * v)
            for d, c, s, v, name in zip(
                distance, np.cos(angle), np.sin(angle), inward, list(PARTNERS) * 15, strict=True
            )
        ],
        **NO_FLOOR,
    )


def momenta(sim: Simulation) -> tuple[np.ndarray, float, float]:
    """Momentum (kg m/s), angular momentum about the origin (kg m^2/s) and the sum of what enters it, in size."""
    state = sim.bottles()
    mass, inertia = sim.model.type_mass[state.type], sim.model.type_inertia[state.type]
    orbital = mass * (state.x * state.vy - state.y * state.vx)
    own = inertia * state.omega
    return (
        np.array([mass @ state.vx, mass @ state.vy]),
        float(orbital.sum() + own.sum()),
        float(np.abs(orbital).sum() + np.abs(own).sum()),
    )


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_momentum_and_angular_momentum_of_a_closed_system(integrator: str) -> None:
    """Kicks come in equal and opposite pairs at one point, and a drift along v changes no r x v."""
    sim = cloud(integrator)
    momentum, angular, size = momenta(sim)
    collided = 0
    for _ in range(80):
        sim.advance()
        collided += sim.contacts().kind.size
    assert collided > 100
    later, angular_later, _ = momenta(sim)
    # 20 000 steps of 30 bottles, each rounded to 1e-16.
    np.testing.assert_allclose(later, momentum, atol=1e-12)
    assert angular_later == pytest.approx(angular, abs=1e-12 * size)


def test_the_papers_lever_arm_does_not_conserve_angular_momentum() -> None:
    """With R for both arms, momentum is conserved and angular momentum is not."""
    sim = cloud("semi_implicit_euler", "radius")
    momentum, angular, size = momenta(sim)
    sim.advance(80)
    later, angular_later, _ = momenta(sim)
    np.testing.assert_allclose(later, momentum, atol=1e-12)
    assert abs(angular_later - angular) > 1e-3 * size


@pytest.mark.parametrize("lever_arm", ["overlap", "radius"])
def test_angular_momentum_gained_in_one_impact(lever_arm: str) -> None:
    """With arms R the moments exceed the couple of the forces by T delta; sliding, T = mu N ~ sin and delta ~ sin:

    gained / (J omega) = <sin^2> / <sin> delta_max / R = pi/4 delta_max / R: 5 % at 4 mm of overlap.
    """
    contact_time, mu, deepest = 0.02, 0.05, 0.004
    speed = deepest * math.pi / contact_time
    slide = 0.6
    sim = simulation(
        tick=0.03,
        accuracy={"per_tick": 6000},
        slip_limit=0.001,
        lever_arm=lever_arm,
        **every_law([contact(stiffness_for(contact_time, MASS / 2.0), friction=mu)]),
        bottles=[bottle(0.0, 0.0, speed, slide), bottle(2.0 * RADIUS + 1e-6, 0.0)],
        **NO_FLOOR,
    )
    _, before, _ = momenta(sim)
    sim.advance()
    assert sim.contacts().kind.size == 0
    _, after, _ = momenta(sim)
    own = MASS * RADIUS**2 * sim.bottles().omega[0]
    gained = (after - before) / own
    if lever_arm == "overlap":
        assert abs(gained) < 1e-11
    else:
        # The normal turns by slide t / 2R meanwhile: 10 % of a radian.
        assert gained == pytest.approx(math.pi / 4.0 * deepest / RADIUS, rel=0.1)

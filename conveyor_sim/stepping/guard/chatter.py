"""Chatter: explicit friction in too long a step turns the slip round at every step, within +-v_lim.

No check of finiteness sees it, nor does an average: velocities are watched from step to step. Their second differences
change sign at every step then, and only then: an impact bends a velocity for some steps to one side.
"""

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World

EXPLICIT = frozenset({"leapfrog", "semi_implicit_euler", "velocity_verlet", "rk4"})
"""The integrators that chatter; the others solve for friction, or look at their errors."""

EVERY = 262144
"""Steps between two times that are listened to; each costs as much as about a hundred steps of a hundred bottles."""

STEPS = 8
"""Steps that are listened to: no contact that is resolved rings at every step for so long."""

LEAST = 0.25
"""Amplitude of chatter, of v_lim, from which it is reported."""


def chatter_of(velocities: F8) -> F8:
    """Amplitude (bottles,) by which velocities (steps, components, bottles) jump to and fro, m/s.

    v_n = (-1)^n A has second differences of 4 A, each against the one before: the median over the steps of the root of
    minus their product.
    """
    bends = np.diff(velocities, n=2, axis=0)
    against = -(bends[1:] * bends[:-1]).sum(axis=1)
    return np.asarray(np.sqrt(np.maximum(np.median(against, axis=0), 0.0)) / 4.0)


def velocities_of(world: World) -> F8:
    """Velocities of all slots, (3, S), m/s: vx, vy and that of the rim."""
    bottles, spin = world.bottles, world.spin
    rim = np.zeros(bottles.vx.size) if spin is None else bottles.radius * spin.omega
    return np.stack([bottles.vx, bottles.vy, rim])

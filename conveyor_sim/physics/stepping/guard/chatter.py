# SPDX-License-Identifier: Apache-2.0
"""Chatter: with steps that are too long, explicit friction reverses the slip at every step, within +-v_lim.

Numbers stay finite and averages look normal, so velocities are compared from step to step. Only chatter changes the
sign of their second differences at every step. In an impact the sign stays the same for several steps.
"""

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World

EXPLICIT = frozenset({"leapfrog", "semi_implicit_euler", "velocity_verlet", "rk4"})
"""Integrators that can chatter. The others solve for friction, or control their errors."""

EVERY = 262144
"""Steps between two checks. A check takes as long as about 100 steps of 100 bottles."""

STEPS = 8
"""Steps in a check. No resolved contact changes direction at every one of them."""

LEAST = 0.25
"""Smallest reported amplitude of chatter, in multiples of v_lim."""


def chatter_of(velocities: F8) -> F8:
    """Return the amplitude (bottles,) of alternating velocities (steps, components, bottles), m/s.

    v_n = (-1)^n A has second differences of 4 A with alternating signs. The result is the median over the steps of the
    root of minus the product of successive differences, over 4.
    """
    bends = np.diff(velocities, n=2, axis=0)
    against = -(bends[1:] * bends[:-1]).sum(axis=1)
    return np.asarray(np.sqrt(np.maximum(np.median(against, axis=0), 0.0)) / 4.0)


class ChatterMeter:
    """Velocities of bottles from step to step, in a run or a study."""

    def __init__(self) -> None:
        self._velocities: list[F8] = []

    def note(self, vx: F8, vy: F8, rim: F8) -> None:
        """Store velocities of the same bottles after a step, (bottles,), m/s. rim: radius times angular velocity."""
        self._velocities.append(np.stack([vx, vy, rim]))

    def worst(self) -> tuple[int, float]:
        """Return index and amplitude (m/s) of the bottle with the largest amplitude; (-1, 0) without bottles."""
        amplitude = chatter_of(np.array(self._velocities))
        if not amplitude.size:
            return -1, 0.0
        worst = int(np.argmax(amplitude))
        return worst, float(amplitude[worst])


def note_world(meter: ChatterMeter, world: World) -> None:
    """Store the velocities of all slots of a World in a meter. Free slots rest."""
    bottles, spin = world.bottles, world.spin
    meter.note(bottles.vx, bottles.vy, np.zeros(bottles.vx.size) if spin is None else bottles.radius * spin.omega)

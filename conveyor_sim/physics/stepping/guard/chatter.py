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


class ChatterMeter:
    """Watches bottles from step to step, for a run that is under way and for a study alike."""

    def __init__(self) -> None:
        self._velocities: list[F8] = []

    def note(self, vx: F8, vy: F8, rim: F8) -> None:
        """Velocities of the same bottles after one more step, (bottles,), m/s; rim: radius times angular velocity."""
        self._velocities.append(np.stack([vx, vy, rim]))

    def worst(self) -> tuple[int, float]:
        """The bottle that shakes most, by its place in what was noted, and its amplitude, m/s; (-1, 0) of none."""
        amplitude = chatter_of(np.array(self._velocities))
        if not amplitude.size:
            return -1, 0.0
        worst = int(np.argmax(amplitude))
        return worst, float(amplitude[worst])


def note_world(meter: ChatterMeter, world: World) -> None:
    """Have a meter note all slots of a World; a free slot rests."""
    bottles, spin = world.bottles, world.spin
    meter.note(bottles.vx, bottles.vy, np.zeros(bottles.vx.size) if spin is None else bottles.radius * spin.omega)

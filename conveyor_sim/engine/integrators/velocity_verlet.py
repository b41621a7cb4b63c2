"""Velocity Verlet, second order in velocity-dependent forces too.

v_half = v + a dt/2; r += dt v_half; a' = a(r, v_half + a dt/2); v = v_half + a' dt/2. Taking a' at v_half alone would
be first order in damping; the prediction to the end of the step is second. Order 2 for undamped springs and smooth
damping; 1 through a dashpot that sets in with a jump at first touch. One force evaluation a step and one more a tick.
"""

from ..arrays import World
from ..compile import kernel
from ..forces import evaluate_forces
from ..motion import accumulate_peaks, drift, kick, lists_hold, recall_velocities, store_velocities
from .phase import RESUME, START


@kernel
def advance(world: World, steps: int, dt: float, phase: int) -> int:
    """Take `steps` steps of dt seconds; return how many were finished (see the package's docstring)."""
    if phase == START:
        # Commands and supply come in between ticks: the last forces are of another line.
        evaluate_forces(world)
    half = 0.5 * dt
    for step in range(steps):
        if phase != RESUME or step > 0:
            kick(world.bottles, world.spin, world.load, half)
            drift(world.bottles, world.spin, dt)
            if not lists_hold(world):
                return step
        store_velocities(world.stage, world.bottles, world.spin)
        kick(world.bottles, world.spin, world.load, half)
        evaluate_forces(world)
        recall_velocities(world.stage, world.bottles, world.spin)
        kick(world.bottles, world.spin, world.load, half)
        accumulate_peaks(world.load, world.peaks, dt)
    return steps

"""Semi-implicit Euler, the paper's integrator (eqs. 5 and 6): v += dt a(r, v), then r += dt v with the new v.

Order 1 through dashpots and friction; for undamped springs its errors in energy stay bounded, and its peak forces are
of order 2. One force evaluation a step.
"""

from ..arrays import World
from ..compile import kernel
from ..forces import evaluate_forces
from ..motion import accumulate_peaks, drift, kick, lists_hold


@kernel
def advance(world: World, steps: int, dt: float, phase: int) -> int:
    """Take up to `steps` steps of dt seconds; return how many were taken (see the package's docstring)."""
    for step in range(steps):
        evaluate_forces(world)
        kick(world.bottles, world.spin, world.load, dt)
        drift(world.bottles, world.spin, dt)
        accumulate_peaks(world.load, world.peaks, dt)
        if not lists_hold(world):
            return step + 1
    return steps

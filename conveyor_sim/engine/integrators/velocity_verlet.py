"""Velocity Verlet, second order in velocity-dependent forces too.

v_half = v + a dt/2; r += dt v_half; a' = a(r, v_half + a dt/2); v = v_half + a' dt/2. Taking a' at v_half alone would
be first order in damping; the prediction to the end of the step is second. Order 2 for smooth damping, friction and an
undamped linear spring, 2.5 in velocity for Hertz; 1 through a dashpot, clamped or not, for its force jumps at first
touch. Measured in a rebound: 1.00 with a dashpot, clamped or not, 1.99 without, 2.46 with Hertz; 2.00 in friction
(test/physics/test_head_on.py, test_contact_laws.py, test_set_down.py). One force evaluation a step, one more a tick.
"""

from ..arrays import Member, World
from ..compile import kernel
from ..damage import note_damage
from ..fewer import for_forces
from ..forces import bottle_forces, evaluate_forces, pack_all, pair_phase
from ..ledger import book_kick
from ..motion import (
    accumulate_peaks,
    drift,
    kick,
    lists_hold,
    note_moved,
    recall_velocities,
    store_velocities,
    watch_rebuilt,
)
from ..moving import pass_step, place_rails
from ..team import BLOCK, share
from .phase import RESUME, START


@kernel
def advance(world: World, member: Member, steps: int, dt: float, phase: int) -> int:
    """Take `steps` steps of dt seconds; return how many were finished (see the package's docstring)."""
    bottles, half = world.bottles, 0.5 * dt
    line = for_forces(world)
    begin, stop = share(member, bottles.x.size)
    place_rails(line.moving, member, dt)
    if phase == START:
        # Commands and supply come in between ticks: the last forces are of another line.
        evaluate_forces(line, member, dt)
    for step in range(steps):
        if phase != RESUME or step > 0:
            note_damage(world, member, dt)
            for first in range(begin, stop, BLOCK):
                end = min(first + BLOCK, stop)
                book_kick(bottles, world.spin, world.load, world.ledger, half, first, end)
                kick(bottles, world.spin, world.load, half, first, end)
                drift(bottles, world.spin, dt, first, end)
                note_moved(line, member, first, end)
            hold = lists_hold(line, member)
            pass_step(line.moving, member, dt)
            if not hold:
                return step
            watch_rebuilt(line, member)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            store_velocities(world.stage, bottles, world.spin, first, end)
            kick(bottles, world.spin, world.load, half, first, end)
        pack_all(line, member)
        pair_phase(line, member, dt, dt)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            bottle_forces(line, member, dt, dt, first, end)
            recall_velocities(world.stage, bottles, world.spin, first, end)
            book_kick(bottles, world.spin, world.load, world.ledger, half, first, end)
            kick(bottles, world.spin, world.load, half, first, end)
            accumulate_peaks(world.load, world.peaks, dt, first, end)
    return steps

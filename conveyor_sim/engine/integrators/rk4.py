# SPDX-License-Identifier: Apache-2.0
"""Classical Runge-Kutta method, with four force evaluations per step, and one more per tick.

It has order 4 where forces are smooth, as in a lasting contact or in friction below v_lim, and 3 through v_lim, where
the friction curve bends. First touch limits its order, as in every method. The order is 1 with a dashpot, clamped or
not, because the force jumps. It is 2 with an undamped linear spring, because the slope of the force jumps, and 2.5 in
velocity with Hertz. The error is a third of velocity Verlet's. Measured orders in a rebound: 1.00 with a dashpot, 0.99
clamped, 1.99 without, 2.50 with Hertz; through friction 4.03 below v_lim, 3.09 across it (test/physics/test_head_on.py,
test_contact_laws.py, test_set_down.py).

Peak forces are those at the start of each step and at the end of the tick, because the states of the other evaluations
are not on the trajectory. They are never larger than the true peak. With n steps per contact, an undamped peak between
two steps is underestimated by up to (pi/n)^2/8. Impulses weight the evaluations as the velocity update does.

Tangential springs in a stage follow the displacement of the stage. They are cut and stored once, at the end of a step:
order 4 while a contact sticks. Within a tick the damage evaluation sees them one step late.
"""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.contact.pairs import pack
from conveyor_sim.engine.contact.path import note_stage, reset_path
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators.motion import lists_hold, note_moved, probe_rebuilt
from conveyor_sim.engine.integrators.phase import RESUME, START
from conveyor_sim.engine.integrators.runge_kutta import (
    add_impulses,
    go_to,
    note_peaks,
    settle_all,
    squared_weights,
    store_slopes,
    store_state,
    turn,
)
from conveyor_sim.engine.observers.damage import note_damage
from conveyor_sim.engine.observers.ledger import book_stages, note_powers
from conveyor_sim.engine.threads.workers import BLOCK, share

STAGES = 4
TIMES = np.array([0.0, 0.5, 0.5, 1.0, 1.0])
WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [0.5, 0.0, 0.0, 0.0],
        [0.0, 0.5, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    ]
)
SQUARED = squared_weights(WEIGHTS)


@kernel
def advance(world: World, worker: Worker, steps: int, dt: float, phase: int) -> int:
    """Take `steps` steps of dt seconds; return how many were finished (see the package's docstring)."""
    bottles = world.bottles
    slopes: Any = world.slopes
    begin, stop = share(worker, bottles.x.size)
    stage = int(slopes.progress[0]) if phase == RESUME else 0
    taken = 0
    if phase == START:
        reset_path(world.path, world.moving, worker)
    pack_all(world, worker)
    while True:
        if stage == 0 and taken < steps:
            note_damage(world, worker, dt)
        # Springs follow the displacement of a stage; they are cut and stored at the end of a step.
        kept = dt if stage == 0 else 0.0
        pair_phase(world, worker, dt, kept)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            bottle_forces(world, worker, dt, kept, first, end)
            if stage == 0:
                note_peaks(world.load, world.peaks, first, end)
                if taken == steps:
                    continue
                store_state(bottles, world.spin, slopes, first, end)
            note_powers(bottles, world.spin, world.load, world.ledger, 0.0, stage, first, end)
            store_slopes(bottles, world.load, world.spin, slopes.normal, slopes, stage, first, end)
            go_to(world, TIMES, WEIGHTS, SQUARED, stage + 1, dt, first, end)
            note_stage(world, TIMES, SQUARED, stage + 1, dt, first, end)
            if stage + 1 == STAGES:
                settle_all(bottles, world.spin, first, end)
                turn(world.spin, slopes, SQUARED, dt, first, end)
                add_impulses(world.peaks, slopes, WEIGHTS, dt, first, end)
                book_stages(world.ledger, WEIGHTS, dt, first, end)
            pack(bottles, first, end)
            note_moved(world, worker, first, end)
        if taken == steps:
            return steps
        stage += 1
        if stage == STAGES:
            stage = 0
            taken += 1
        if not lists_hold(world, worker):
            if worker.rank == 0:
                slopes.progress[0] = stage
            return taken
        if stage == 0:
            probe_rebuilt(world, worker)

# SPDX-License-Identifier: Apache-2.0
"""Impulses: implicit contacts in short substeps of h, solved by a few sweeps of Gauss-Seidel over the velocities.

Contacts stiffer than a substep resolves stay stable and press with the right forces once the sweeps have passed the
depth of the queue; fast impacts rebound in closed form. A substep is

1. the impulses that contacts held in the last substep (warm start), then friction under each bottle, implicit;
2. `sweeps` times: all pairs, colour by colour, then all rails and bodies (`impulses/law.py`), then drives off profile;
3. r += h v, and axes and bodies move.

Bottles that sleep are left out (`impulses/sleep.py`).

The step is that of Catto (GDC 2006) with the compliance of Bender et al. (2014) and short substeps as in Macklin et al.
(2019). The positions of pressed contacts are corrected without a velocity, so no energy enters. Forces of single
contacts in a crowd converge slowly, with the root of substeps times sweeps; docs/accuracy.md has the errors.
"""

from typing import Any

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.impulses.bodies import end_bodies, find_bodies, sweep_bodies
from conveyor_sim.engine.impulses.bottles import begin_substep, end_substep, take_step, warm_anew
from conveyor_sim.engine.impulses.constants import fill_constants
from conveyor_sim.engine.impulses.drives import begin_drives, clear_marks, pass_bodies, sweep_drives
from conveyor_sim.engine.impulses.loads import begin_loads, end_loads
from conveyor_sim.engine.impulses.pairs import sweep_pairs
from conveyor_sim.engine.impulses.rails import sweep_rails
from conveyor_sim.engine.impulses.runs import run_of, runs_from, runs_to
from conveyor_sim.engine.impulses.work import begin_work, book_pressed, mean_velocities
from conveyor_sim.engine.integrators.motion import lists_hold, probe_rebuilt
from conveyor_sim.engine.lists.ways import may_leave
from conveyor_sim.engine.rails.moving import place_rails
from conveyor_sim.engine.support.footing import check_footing
from conveyor_sim.engine.threads.workers import BLOCK, MOVED, raise_flag, share, wait_for_all

SLOWEST_IMPACT = 5e-3
"""Closing speed below which a contact presses without an impact, m/s; and 4 times what friction changes in h."""


@kernel
def advance(world: World, worker: Worker, steps: int, dt: float, phase: int) -> int:
    """Take up to `steps` substeps of dt seconds; return how many were taken (see the package's docstring)."""
    bottles = world.bottles
    impulses: Any = world.impulses
    begin, stop = share(worker, bottles.x.size)
    place_rails(world.moving, worker, dt)
    if worker.rank == 0:
        fill_constants(world, impulses, dt)
        take_step(world, impulses, dt)
        clear_marks(impulses.bodies)
    wait_for_all(worker)
    threshold = max(SLOWEST_IMPACT, 4.0 * impulses.grip * dt)
    for step in range(steps):
        warm_anew(world, worker, impulses)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            check_footing(bottles, world.belts, world.surface, world.footing, world.ring, first, end)
            for run in range(runs_from(impulses.sleep, first), runs_to(impulses.sleep, end)):
                left, right = run_of(impulses.sleep, first, end, run)
                begin_substep(world, impulses, dt, left, right)
            find_bodies(world, worker, impulses, impulses.bodies, dt, first, end)
            begin_work(world, impulses, dt, first, end)
            begin_loads(world, impulses, dt, first, end)
        wait_for_all(worker)
        begin_drives(world, worker, impulses.bodies, dt)
        for sweep in range(impulses.sweeps):
            last = sweep + 1 == impulses.sweeps
            sweep_pairs(world, worker, impulses, dt, threshold, last)
            for first in range(begin, stop, BLOCK):
                end = min(first + BLOCK, stop)
                sweep_rails(world, impulses, dt, threshold, last, first, end)
                sweep_bodies(world, impulses, impulses.bodies, dt, threshold, first, end)
            sweep_drives(world, worker, impulses, impulses.bodies, dt, threshold, last)
            if not last:
                wait_for_all(worker)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            end_bodies(world, impulses, impulses.bodies, dt, first, end)
            mean_velocities(world, impulses, first, end)
            for run in range(runs_from(impulses.sleep, first), runs_to(impulses.sleep, end)):
                left, right = run_of(impulses.sleep, first, end, run)
                end_substep(world, impulses, dt, left, right)
                if may_leave(bottles, world.neighbourhood, dt, left, right):
                    raise_flag(worker, MOVED)
            end_loads(world, impulses, dt, first, end)
        book_pressed(world, worker, impulses)
        hold = lists_hold(world, worker)
        pass_bodies(world, worker, impulses.bodies, dt)
        if not hold:
            return step + 1
        probe_rebuilt(world, worker)
    return steps

# SPDX-License-Identifier: Apache-2.0
"""Parts of integrators: the kick (velocities), and the work that follows every step.

Each part works on bottles first to end.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.integrators.callees import call_probe, call_rebuild
from conveyor_sim.engine.lists.neighbours import fill_laws
from conveyor_sim.engine.lists.rebuild import moved_too_far
from conveyor_sim.engine.lists.riding import wake_all
from conveyor_sim.engine.threads.workers import MOVED, flag_raised, lower_flag, raise_flag, wait_for_all

TINY = 1e-100
"""Speed below which a bottle rests, m/s or rad/s. Decaying speeds would become denormal numbers, which are slow."""


@part
def settle(speed: float) -> float:
    """Return the speed, or 0 if it is below TINY. NaN stays NaN, so that it is detected."""
    return 0.0 if abs(speed) <= TINY else speed


@part
def kick(bottles: Bottles, spin: Any, load: ForceSums, dt: float, first: int, end: int) -> None:
    """Apply v += dt a and omega += dt alpha, with a = F/m, alpha = M/J (paper eqs. 1, 5)."""
    for i in range(uint64(first), uint64(end)):
        bottles.vx[i] = settle(bottles.vx[i] + dt * (load.fx[i] * bottles.inverse_mass[i]))
        bottles.vy[i] = settle(bottles.vy[i] + dt * (load.fy[i] * bottles.inverse_mass[i]))
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.omega[i] = settle(spin.omega[i] + dt * (spin.moment[i] * spin.inverse_inertia[i]))


@part
def accumulate_peaks(load: ForceSums, peaks: Any, dt: float, first: int, end: int) -> None:
    """Update each bottle's largest normal force (N) and the impulse of all its normal forces (N s)."""
    if peaks is None:
        return
    _accumulate(load.normal_max, load.normal_sum, peaks, dt, first, end)


@part
def _accumulate(largest: Any, sums: Any, peaks: Any, dt: float, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        peaks.force[i] = largest[i] if largest[i] > peaks.force[i] else peaks.force[i]
        peaks.impulse[i] += dt * sums[i]


@part
def note_moved(world: World, worker: Worker, first: int, end: int) -> None:
    """Raise the flag MOVED if a bottle of first to end has left the range for which the lists hold."""
    if moved_too_far(world.bottles, world.neighbourhood, world.settings.skin, first, end):
        raise_flag(worker, MOVED)


@part
def lists_hold(world: World, worker: Worker) -> bool:
    """Wait for all; rebuild the lists if a bottle has moved too far. Return False if a list is too short."""
    wait_for_all(worker)
    if flag_raised(worker, MOVED):
        wait_for_all(worker)
        if worker.rank == 0:
            lower_flag(worker, MOVED)
            call_rebuild(world, worker)
            fill_laws(world.pairs, world.pair_law, world.bottles)
            world.probe.due[0] = 1
        wait_for_all(worker)
        wake_all(world.riding, world.bottles, worker)
    return world.neighbourhood.stale[0] == 0


@part
def probe_rebuilt(world: World, worker: Worker) -> None:
    """Update the deepest overlaps at the end of a step if the lists were rebuilt in the meantime (`guard_probe.py`)."""
    if world.probe.due[0] != 0:
        wait_for_all(worker)
        if worker.rank == 0:
            call_probe(world, worker)
            world.probe.due[0] = 0
        wait_for_all(worker)

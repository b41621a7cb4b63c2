# SPDX-License-Identifier: Apache-2.0
"""Displacements of bottles since the last update of the tangential springs, from which integrators elongate springs.

Semi-implicit Euler and leapfrog elongate a spring by dt times the slip at which they evaluate forces. Velocity Verlet
and rk4 evaluate forces at velocities other than those that move the bottles. Their springs follow the displacements of
bottles (`World.path`), and are as accurate as the positions.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.integrators import Stage
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.threads.workers import share


@part
def note_path(path: Any, stage: Stage, dt: float, first: int, end: int) -> None:
    """Set the displacements of bottles first to end to the motion in dt (s) at the velocities in `stage`."""
    if path is None:
        return
    for i in range(uint64(first), uint64(end)):
        path.x[i] = dt * stage.vx[i]
        path.y[i] = dt * stage.vy[i]
        path.turn[i] = dt * stage.omega[i]


@part
def note_stage(world: World, times: F8, squared: F8, s: int, h: float, first: int, end: int) -> None:
    """Set the displacements of bottles first to end in stage s of a step of h (s); `runge_kutta.py` has the tableau."""
    path, bottles, slopes = world.path, world.bottles, world.slopes
    if path is None:
        return
    for i in range(uint64(first), uint64(end)):
        path.x[i] = bottles.x[i] - slopes.x[i]
        path.y[i] = bottles.y[i] - slopes.y[i]
    if world.spin is not None:
        for i in range(uint64(first), uint64(end)):
            path.turn[i] = h * times[s] * slopes.omega[i]
        for stage in range(s):
            j: Any = uint64(stage)
            for i in range(uint64(first), uint64(end)):
                path.turn[i] += h * h * squared[s, stage] * slopes.alpha[j, i]


@part
def reset_path(path: Any, moving: Any, worker: Worker) -> None:
    """Reset all displacements; springs already include them. All workers see this after the next `wait_for_all`."""
    if path is None:
        return
    begin, stop = share(worker, path.x.size)
    for i in range(begin, stop):
        path.x[i] = path.y[i] = path.turn[i] = 0.0
    if worker.rank == 0:
        _reset_rails(moving)


@part
def _reset_rails(moving: Any) -> None:
    if moving is None:
        return
    _clear(moving.springs)


@part
def _clear(springs: Any) -> None:
    if springs is None:
        return
    springs.elapsed[0] = 0.0
    for b in range(springs.path.size):
        springs.path[b] = springs.aside[b] = 0.0


@part
def slip_time_of(path: Any, spring_dt: float) -> float:
    """Return the time (s) of slip by which springs are elongated; 0 if they follow a path."""
    if path is None:
        return spring_dt
    return 0.0


@part
def displacement_in_touch(displacement: float, approach: float, overlap: float) -> float:
    """Return the part of a tangential displacement (m) that occurred during contact. approach: m, overlap gained."""
    depth = 0.0 if overlap < 0.0 else overlap
    return displacement * (depth / approach) if depth < approach else displacement

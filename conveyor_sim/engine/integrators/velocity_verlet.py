# SPDX-License-Identifier: Apache-2.0
"""Velocity Verlet, second order in velocity-dependent forces, too.

v_half = v + a dt/2; r += dt v_half; a' = a(r, v_half + a dt/2); v = v_half + a' dt/2. With a' at v_half alone the
method would be first order in damping; the prediction to the end of the step makes it second. The order is 2 for smooth
damping, friction and an undamped linear spring, 2.5 in velocity for Hertz. It is 1 through a dashpot, clamped or not,
because its force jumps at first touch. Measured in a rebound: 1.00 with a dashpot, clamped or not, 1.99 without, 2.46
with Hertz; 2.00 in friction (test/physics/test_head_on.py, test_contact_laws.py, test_set_down.py). A step takes one
force evaluation, a tick one more.

Tangential springs are elongated by the displacement of the drift, dt v_half, and cut at the end of the step: order 2,
and no cycle of sticking and slipping gains energy. A drag gamma is unstable from gamma dt = 1 on: the force then
oscillates from step to step, while velocities hardly do (test/physics/test_drag_limits.py). Implicit friction
is stable in steps of any length (`friction.py`).
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.integrators import Stage
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.pairs import pack_row
from conveyor_sim.engine.contact.path import note_path, reset_path
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators.motion import accumulate_peaks, kick, lists_hold, note_moved, probe_rebuilt, settle
from conveyor_sim.engine.integrators.phase import START
from conveyor_sim.engine.lists.riding import (
    begin_examination,
    end_examination,
    ride,
    step_all,
    stepped_run,
    stepped_runs,
)
from conveyor_sim.engine.observers.damage import note_damage
from conveyor_sim.engine.observers.ledger import book_kick
from conveyor_sim.engine.rails.moving import pass_step, place_rails
from conveyor_sim.engine.support.static_friction import carry_anchors
from conveyor_sim.engine.support.vibration import pass_vibration, place_vibration, vibrate_footing
from conveyor_sim.engine.threads.workers import BLOCK, share


@kernel
def advance(world: World, worker: Worker, steps: int, dt: float, phase: int) -> int:
    """Take `steps` steps of dt seconds; return how many were finished (see the package's docstring).

    A step ends and the next one starts in one pass over the bottles. After an interrupted call, bottles are already at
    their next positions.
    """
    stage: Any = world.stage
    damage = _is_there(world.damage)
    begin, stop = share(worker, world.bottles.x.size)
    place_rails(world.moving, worker, dt)
    place_vibration(world.vibration, world.surface, worker, dt)
    # Commands and supply act between ticks, so the last forces are outdated. The first evaluation ends no step.
    fresh = phase == START
    if fresh:
        reset_path(world.path, world.moving, worker)
        _start_stage(world.bottles, stage, world.implicit, begin, stop)
    step_all(world.riding, world.bottles, worker)
    pack_all(world, worker)
    vibrate_footing(world, worker)
    done = 0
    while True:
        drawn = 0.0 if fresh else dt
        done += not fresh
        # Forces have a single call site, because each call site is compiled separately.
        pair_phase(world, worker, dt, drawn)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            bottle_forces(world, worker, dt, drawn, first, end)
            if not fresh:
                _end_step(world, stage, dt, first, end)
                end_examination(world, stage, first, end)
            if done < steps and not damage:
                _begin_step(world, stage, worker, dt, first, end)
        if done == steps:
            return steps
        if damage:
            note_damage(world, worker, dt)
            for first in range(begin, stop, BLOCK):
                _begin_step(world, stage, worker, dt, first, min(first + BLOCK, stop))
        hold = lists_hold(world, worker)
        pass_step(world.moving, world.ledger, worker, dt, True)
        pass_vibration(world, worker, dt)
        if not hold:
            return done
        probe_rebuilt(world, worker)
        fresh = False


@part
def _start_stage(bottles: Bottles, stage: Stage, implicit: Any, begin: int, stop: int) -> None:
    """Set the velocities at mid-step for implicit friction in the first evaluation, at the present velocities."""
    if implicit is None:
        return
    for i in range(uint64(begin), uint64(stop)):
        stage.vx[i] = bottles.vx[i]
        stage.vy[i] = bottles.vy[i]


@part
def _is_there(group: Any) -> bool:
    return group is not None


@part
def _begin_step(world: World, stage: Stage, worker: Worker, dt: float, first: int, end: int) -> None:
    """Move bottles first to end, and set the velocities at which the forces at the end of the step are evaluated."""
    bottles, spin, load, half = world.bottles, world.spin, world.load, 0.5 * dt
    book_kick(bottles, spin, load, world.ledger, half, first, end)
    begin_examination(bottles, spin, world.riding, first, end)
    for run in range(stepped_runs(world.riding, first)):
        left, right = stepped_run(world.riding, first, end, run)
        _move(bottles, load, stage, dt, left, right)
        _turn(spin, stage, dt, left, right)
        note_path(world.path, stage, dt, left, right)
    ride(bottles, spin, world.riding, dt, first, end)
    carry_anchors(world.footing, world.vibration, world.static_friction, dt, first, end)
    note_moved(world, worker, first, end)


@part
def _end_step(world: World, stage: Stage, dt: float, first: int, end: int) -> None:
    """Set the velocities of bottles first to end at the end of the step, from those at its middle."""
    bottles, spin, load, half = world.bottles, world.spin, world.load, 0.5 * dt
    for run in range(stepped_runs(world.riding, first)):
        left, right = stepped_run(world.riding, first, end, run)
        _recall(bottles, spin, stage, left, right)
    book_kick(bottles, spin, load, world.ledger, half, first, end)
    for run in range(stepped_runs(world.riding, first)):
        left, right = stepped_run(world.riding, first, end, run)
        kick(bottles, spin, load, half, left, right)
        accumulate_peaks(load, world.peaks, dt, left, right)


@part
def _move(bottles: Bottles, load: ForceSums, stage: Stage, dt: float, first: int, end: int) -> None:
    half = 0.5 * dt
    for i in range(uint64(first), uint64(end)):
        kick_x = half * (load.fx[i] * bottles.inverse_mass[i])
        kick_y = half * (load.fy[i] * bottles.inverse_mass[i])
        vx, vy = settle(bottles.vx[i] + kick_x), settle(bottles.vy[i] + kick_y)
        x, y = bottles.x[i] + dt * vx, bottles.y[i] + dt * vy
        stage.vx[i], stage.vy[i] = vx, vy
        vx, vy = settle(vx + kick_x), settle(vy + kick_y)
        bottles.x[i], bottles.y[i], bottles.vx[i], bottles.vy[i] = x, y, vx, vy
        pack_row(bottles.packed, i, x, y, vx, vy)


@part
def _turn(spin: Any, stage: Stage, dt: float, first: int, end: int) -> None:
    if spin is None:
        return
    for i in range(uint64(first), uint64(end)):
        kick_turn = 0.5 * dt * (spin.moment[i] * spin.inverse_inertia[i])
        omega = settle(spin.omega[i] + kick_turn)
        stage.omega[i] = omega
        spin.theta[i] += dt * omega
        spin.omega[i] = settle(omega + kick_turn)


@part
def _recall(bottles: Bottles, spin: Any, stage: Stage, first: int, end: int) -> None:
    """Restore the velocities at the middle of the step."""
    for i in range(uint64(first), uint64(end)):
        bottles.vx[i] = stage.vx[i]
        bottles.vy[i] = stage.vy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.omega[i] = stage.omega[i]

# SPDX-License-Identifier: Apache-2.0
"""Semi-implicit Euler, the paper's integrator (eqs. 5 and 6), and leapfrog: v += dt a(r, v), then r += dt v, the new v.

Velocities are those of mid-step, positions those of the end of the step. Semi-implicit Euler treats both as
simultaneous, so a bottle that a turning belt carries seems to slip outward by half a step's acceleration. Its resting
forces then have a relative error of mu g dt / v_lim. Leapfrog uses the belt's velocity at the bottle's mid-step
position (`EngineSettings.lag`) and has no such error (test/physics/test_resting_load.py). On straight belts and floors
the two agree to the bit.

The order is 1 with friction and with all damping: dashpots, clamped or not, and forces without a jump at first touch.
Without damping its errors in energy stay bounded; rebounds and peak forces then converge with order 2, rebounds with
Hertz with order 2.5. Measured orders for a rebound: 0.93 with a dashpot, 0.99 clamped, 1.99 without, 2.46 with Hertz;
1.00 in friction (test/physics/test_head_on.py, test_contact_laws.py, test_set_down.py). A step takes one force
evaluation.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.pairs import pack_row
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators.motion import accumulate_peaks, lists_hold, note_moved, probe_rebuilt, settle
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
    """Take up to `steps` steps of dt seconds; return how many were taken (see the package's docstring)."""
    bottles = world.bottles
    begin, stop = share(worker, bottles.x.size)
    place_rails(world.moving, worker, dt)
    place_vibration(world.vibration, world.surface, worker, dt)
    step_all(world.riding, bottles, worker)
    pack_all(world, worker)
    vibrate_footing(world, worker)
    for step in range(steps):
        note_damage(world, worker, dt)
        pair_phase(world, worker, dt, dt)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            bottle_forces(world, worker, dt, dt, first, end)
            book_kick(bottles, world.spin, world.load, world.ledger, dt, first, end)
            begin_examination(bottles, world.spin, world.riding, first, end)
            for run in range(stepped_runs(world.riding, first)):
                left, right = stepped_run(world.riding, first, end, run)
                _move(bottles, world.load, dt, left, right)
                _turn(world.spin, dt, left, right)
                _note_kick(world, world.implicit, dt, left, right)
                accumulate_peaks(world.load, world.peaks, dt, left, right)
            ride(bottles, world.spin, world.riding, dt, first, end)
            end_examination(world, None, first, end)
            carry_anchors(world.footing, world.vibration, world.static_friction, dt, first, end)
            note_moved(world, worker, first, end)
        hold = lists_hold(world, worker)
        pass_step(world.moving, world.ledger, worker, dt, False)
        pass_vibration(world, worker, dt)
        if not hold:
            return step + 1
        probe_rebuilt(world, worker)
    return steps


@part
def _move(bottles: Bottles, load: ForceSums, dt: float, first: int, end: int) -> None:
    """Move bottles first to end and pack them for the next step, in one pass."""
    for i in range(uint64(first), uint64(end)):
        vx = settle(bottles.vx[i] + dt * (load.fx[i] * bottles.inverse_mass[i]))
        vy = settle(bottles.vy[i] + dt * (load.fy[i] * bottles.inverse_mass[i]))
        x = bottles.x[i] + dt * vx
        y = bottles.y[i] + dt * vy
        bottles.vx[i] = vx
        bottles.vy[i] = vy
        bottles.x[i] = x
        bottles.y[i] = y
        pack_row(bottles.packed, i, x, y, vx, vy)


@part
def _note_kick(world: World, implicit: Any, dt: float, first: int, end: int) -> None:
    """Store the changes of velocity, from which implicit friction predicts the slip of the next step."""
    if implicit is None:
        return
    if implicit.kick is None:
        return
    bottles, spin, load, kick = world.bottles, world.spin, world.load, implicit.kick
    for i in range(uint64(first), uint64(end)):
        kick.x[i] = dt * (load.fx[i] * bottles.inverse_mass[i])
        kick.y[i] = dt * (load.fy[i] * bottles.inverse_mass[i])
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            kick.turn[i] = dt * (spin.moment[i] * spin.inverse_inertia[i])


@part
def _turn(spin: Any, dt: float, first: int, end: int) -> None:
    if spin is None:
        return
    for i in range(uint64(first), uint64(end)):
        omega = settle(spin.omega[i] + dt * (spin.moment[i] * spin.inverse_inertia[i]))
        spin.omega[i] = omega
        spin.theta[i] += dt * omega

# SPDX-License-Identifier: Apache-2.0
"""Drives of axes off their profiles, as impulses, and the motion of all bodies at the end of a substep.

Such an axis is a mass in the sweeps, like a bottle: its contacts act on it, then its drive, with at most its limit
times h, towards the speed that it should have. All its contacts share this mass, so one thread visits them, in order.
At the end of the substep the forces of the last sweep move the axis, as with explicit steps (`actuators.py`).
"""

from typing import Any

from conveyor_sim.engine.arrays.impulses import CONTACTS, GEOMETRY, BodyImpulses
from conveyor_sim.engine.arrays.moving import OFF_PROFILE, ON_PROFILE, Actuators, MovingBodies
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.impulses.bodies import ACROSS, ASIDE, NORMAL, held_work, visit_body
from conveyor_sim.engine.rails.actuators import leave_profile, wanted_speed
from conveyor_sim.engine.rails.moving import pass_step
from conveyor_sim.engine.rails.poses import mean_speed
from conveyor_sim.engine.threads.workers import units, wait_for_all

SETTLING = 8
"""Sweeps over the contacts of axes that leave their profiles in a substep."""


@part
def begin_drives(world: World, worker: Worker, bodies: Any, h: float) -> None:
    """Give axes off their profiles the speeds with which a substep of h (s) begins: held impulses and drives act."""
    if bodies is None:
        return
    _begin_drives(world, worker, world.moving, world.moving.actuators, bodies, h)


@part
def _begin_drives(
    world: World, worker: Worker, moving: MovingBodies, actuators: Any, bodies: BodyImpulses, h: float
) -> None:
    if actuators is None:
        return
    if not _any_off(moving, actuators):
        return
    if worker.rank == 0:
        for entry in range(moving.actives[0]):
            a = moving.active[entry]
            bodies.speed[a], bodies.drive[a] = moving.speed[a], 0.0
        railed = world.railed
        first, end = units(0, world.bottles.x.size)
        for entry in range(railed.first[first], railed.first[end]):
            i = railed.bottle[entry]
            for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
                if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                    a = bodies.axis[place]
                    bodies.speed[a] += held_work(bodies, place) / actuators.mass[a]
        _drive(moving, actuators, bodies, h)
    wait_for_all(worker)


@part
def sweep_drives(
    world: World, worker: Worker, impulses: Any, bodies: Any, h: float, threshold: float, last: bool
) -> None:
    """Visit the contacts of axes off their profiles, then their drives; on return all are done."""
    if bodies is None:
        return
    _sweep_drives(world, worker, world.moving, world.moving.actuators, impulses, bodies, h, threshold, last)


@part
def _sweep_drives(
    world: World,
    worker: Worker,
    moving: MovingBodies,
    actuators: Any,
    impulses: Any,
    bodies: BodyImpulses,
    h: float,
    threshold: float,
    last: bool,
) -> None:
    if actuators is None:
        return
    off = _any_off(moving, actuators)
    if not (off or last):
        return
    wait_for_all(worker)
    if worker.rank == 0:
        if off:
            _sweep_off(world, moving, actuators, impulses, bodies, h, threshold, last)
        if last and _leave_profiles(world, moving, actuators, bodies, h):
            for _ in range(SETTLING):
                _sweep_off(world, moving, actuators, impulses, bodies, h, threshold, False)
    wait_for_all(worker)


@part
def _sweep_off(
    world: World,
    moving: MovingBodies,
    actuators: Actuators,
    impulses: Any,
    bodies: BodyImpulses,
    h: float,
    threshold: float,
    last: bool,
) -> None:
    railed = world.railed
    first, end = units(0, world.bottles.x.size)
    for entry in range(railed.first[first], railed.first[end]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                if actuators.mode[bodies.axis[place]] == OFF_PROFILE:
                    visit_body(i, place, world, moving, impulses, bodies, h, threshold, last, True)
    _drive(moving, actuators, bodies, h)


@part
def _leave_profiles(
    world: World, moving: MovingBodies, actuators: Actuators, bodies: BodyImpulses, h: float
) -> bool:
    """Take axes off profiles that their drives can't follow against the forces of the last sweep; return True if any.

    Their bodies had no mass in this substep, so it must still be solved for them.
    """
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        bodies.leaves[a] = 0
        if actuators.mode[a] == ON_PROFILE:
            bodies.speed[a] = 0.0
    railed = world.railed
    first, end = units(0, world.bottles.x.size)
    for entry in range(railed.first[first], railed.first[end]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                if actuators.mode[bodies.axis[place]] == ON_PROFILE:
                    bodies.speed[bodies.axis[place]] += held_work(bodies, place)
    leaves = False
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        if actuators.mode[a] == ON_PROFILE:
            push = bodies.speed[a] / h
            for unit in range(actuators.push.shape[0]):
                push += actuators.push[unit, a, 0]
            mean = mean_speed(moving, a, h)
            leave_profile(actuators, moving, a, push, moving.clock[0] * h)
            if actuators.mode[a] == OFF_PROFILE:
                leaves = True
                bodies.leaves[a], bodies.drive[a] = 1, mean
                bodies.speed[a] = moving.speed[a] + h * push / actuators.mass[a]
    if leaves:
        _use_speeds(world, moving, bodies)
        for entry in range(moving.actives[0]):
            a = moving.active[entry]
            if bodies.leaves[a] != 0:
                bodies.drive[a] = 0.0
        _drive(moving, actuators, bodies, h)
    return leaves


@part
def _use_speeds(world: World, moving: MovingBodies, bodies: BodyImpulses) -> None:
    """Take the speeds of the profiles, in `drive`, out of the contacts of axes that leave them."""
    railed, geometry = world.railed, bodies.geometry
    first, end = units(0, world.bottles.x.size)
    for entry in range(railed.first[first], railed.first[end]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            a = bodies.axis[place]
            if bodies.piece[place] >= 0 and a >= 0:
                if bodies.leaves[a] != 0:
                    geometry[GEOMETRY * place + NORMAL] = 0.0
                    geometry[GEOMETRY * place + ACROSS] -= bodies.drive[a] * geometry[GEOMETRY * place + ASIDE]


@part
def _any_off(moving: MovingBodies, actuators: Actuators) -> bool:
    for entry in range(moving.actives[0]):
        if actuators.mode[moving.active[entry]] == OFF_PROFILE:
            return True
    return False


@part
def _drive(moving: MovingBodies, actuators: Actuators, bodies: BodyImpulses, h: float) -> None:
    """Let the drives act, at most with their limits in h (s), and the end stops."""
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        if actuators.mode[a] == OFF_PROFILE:
            missing = wanted_speed(actuators, moving, a, moving.clock[0] * h, h) - bodies.speed[a]
            most = h * actuators.limit[a]
            drive = min(max(bodies.drive[a] + actuators.mass[a] * missing, -most), most)
            speed = bodies.speed[a] + (drive - bodies.drive[a]) / actuators.mass[a]
            bodies.drive[a] = drive
            speed = max(speed, (actuators.low[a] - moving.position[a]) / h)
            bodies.speed[a] = min(speed, (actuators.stroke[a] - moving.position[a]) / h)


@part
def pass_bodies(world: World, worker: Worker, bodies: Any, h: float) -> None:
    """Move axes and bodies by a substep of h (s), right after a `wait_for_all`; on return all workers see it."""
    if bodies is None:
        return
    if worker.rank == 0:
        _add_struck(world.moving, world.moving.actuators, bodies)
    pass_step(world.moving, None, worker, h, False)


@part
def _add_struck(moving: MovingBodies, actuators: Any, bodies: BodyImpulses) -> None:
    """Add the impacts that drives have withstood to the loads of the axes, unit by unit."""
    if actuators is None:
        return
    axes = actuators.mode.size
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        for unit in range(actuators.push.shape[0]):
            actuators.load[a] += bodies.struck[unit * axes + a]

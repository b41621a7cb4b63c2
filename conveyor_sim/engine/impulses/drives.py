# SPDX-License-Identifier: Apache-2.0
"""Drives of axes off their profiles, as impulses, and the motion of all bodies at the end of a substep.

Such an axis is a mass in the sweeps, like a bottle: its contacts act on it, then its drive, with at most its limit
times h, towards the speed that it should have. All its contacts share this mass, so one thread visits them, in order.
At the end of the substep the forces of the last sweep move the axis, as with explicit steps (`actuators.py`).
"""

from typing import Any

from conveyor_sim.engine.arrays.impulses import ACROSS, ASIDE, CONTACTS, GEOMETRY, NORMAL, BodyImpulses
from conveyor_sim.engine.arrays.moving import OFF_PROFILE, ON_PROFILE, Actuators, MovingBodies
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.impulses.bodies import LEFT, MARKED, held_work, visit_body
from conveyor_sim.engine.rails.actuators import leave_profile, overloads, wanted_speed
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
    wait_for_all(worker)
    if worker.rank == 0:
        _leave_profiles(world, moving, actuators, bodies, h)
        if _any_off(moving, actuators):
            _sweep_off(world, moving, actuators, impulses, bodies, h, threshold)
        if last:
            _mark_overloaded(world, moving, actuators, bodies, h)
            if _leave_profiles(world, moving, actuators, bodies, h):
                for _ in range(SETTLING):
                    _sweep_off(world, moving, actuators, impulses, bodies, h, threshold)
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
) -> None:
    railed = world.railed
    first, end = units(0, world.bottles.x.size)
    for entry in range(railed.first[first], railed.first[end]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                if actuators.mode[bodies.axis[place]] == OFF_PROFILE:
                    visit_body(i, place, world, moving, impulses, bodies, h, threshold, True)
    _drive(moving, actuators, bodies, h)


@part
def _mark_overloaded(world: World, moving: MovingBodies, actuators: Actuators, bodies: BodyImpulses, h: float) -> None:
    """Mark axes that can't follow their profiles against the forces of the last sweep."""
    for entry in range(moving.actives[0]):
        if actuators.mode[moving.active[entry]] == ON_PROFILE:
            bodies.speed[moving.active[entry]] = 0.0
    railed = world.railed
    first, end = units(0, world.bottles.x.size)
    for entry in range(railed.first[first], railed.first[end]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                if actuators.mode[bodies.axis[place]] == ON_PROFILE:
                    bodies.speed[bodies.axis[place]] += held_work(bodies, place)
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        if actuators.mode[a] == ON_PROFILE:
            if overloads(actuators, moving, a, bodies.speed[a] / h, moving.clock[0] * h):
                bodies.leaves[a] = MARKED


@part
def _leave_profiles(world: World, moving: MovingBodies, actuators: Actuators, bodies: BodyImpulses, h: float) -> bool:
    """Take marked axes off their profiles within the substep of h (s); return True if there are any.

    Their bodies had no mass in this substep until now, so their contacts must still be solved.
    """
    leave = False
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        if bodies.leaves[a] == MARKED:
            leave = True
            # `drive` holds the speed of the profile until it is taken out of the contacts.
            bodies.drive[a], bodies.speed[a] = mean_speed(moving, a, h), moving.speed[a]
            leave_profile(actuators, moving, a)
    if leave:
        railed = world.railed
        first, end = units(0, world.bottles.x.size)
        for entry in range(railed.first[first], railed.first[end]):
            i = railed.bottle[entry]
            for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
                if bodies.piece[place] >= 0 and bodies.axis[place] >= 0:
                    if bodies.leaves[bodies.axis[place]] == MARKED:
                        _use_speed(bodies, place, bodies.axis[place], actuators.mass[bodies.axis[place]])
        for entry in range(moving.actives[0]):
            a = moving.active[entry]
            if bodies.leaves[a] == MARKED:
                bodies.leaves[a], bodies.drive[a] = LEFT, 0.0
        _drive(moving, actuators, bodies, h)
    return leave


@part
def _use_speed(bodies: BodyImpulses, place: int, a: int, mass: float) -> None:
    """Take the speed of the profile, in `drive`, out of a contact, and let the contact act on the axis."""
    g, geometry = GEOMETRY * place, bodies.geometry
    geometry[g + NORMAL] = 0.0
    geometry[g + ACROSS] -= bodies.drive[a] * geometry[g + ASIDE]
    bodies.speed[a] += held_work(bodies, place) / mass


@part
def _any_off(moving: MovingBodies, actuators: Actuators) -> bool:
    off = False
    for entry in range(moving.actives[0]):
        off = off or actuators.mode[moving.active[entry]] == OFF_PROFILE
    return off


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
    """Move axes and bodies by a substep of h (s), right after a `wait_for_all`; on return all workers see it.

    bodies: None if bottles pass through bodies.
    """
    if worker.rank == 0:
        _end_sweeps(world, bodies)
    pass_step(world.moving, None, worker, h, False)


@part
def _end_sweeps(world: World, bodies: Any) -> None:
    if bodies is None:
        return
    _add_struck(world.moving, world.moving.actuators, bodies)
    clear_marks(bodies)


@part
def clear_marks(bodies: Any) -> None:
    """Forget which axes left their profiles."""
    if bodies is None:
        return
    for a in range(bodies.leaves.size):
        bodies.leaves[a] = 0


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

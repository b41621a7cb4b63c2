# SPDX-License-Identifier: Apache-2.0
"""Drives of axes, with limited force: an axis follows its profile, or is a mass that bottles can hold up.

While its drive can exert the force that the profile needs, M a minus the force of the bottles, the axis is on its
profile. Otherwise it is a mass M between the end stops, M a = F + Q. F is within the limit, as near as possible to the
force for the fastest motion to the target; Q is the sum of the bottles' forces on all bodies of the axis. As soon as
the limit suffices again, a new profile starts at the axis's position. An endless axis has a speed as its target, and
goes on from its position with the rest of its profile. The bottles' forces are summed by units of bottles in their
order, then unit by unit, so the sum does not depend on the threads.

A force on a body acts on the axis by its virtual work. For an axis that turns, force, mass and m stand for torque,
moment of inertia and rad.
"""

from typing import Any

from conveyor_sim.engine.arrays.moving import HELD, OFF_PROFILE, ON_PROFILE, PHASES, Actuators, MovingBodies
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.observers.ledger import BELTS, CONTACT_FRICTION, DAMPING
from conveyor_sim.engine.rails.motion_profile import phase_at, plan_profile, stopping_place, wanted_acceleration
from conveyor_sim.engine.threads.workers import UNIT, units


@part
def clear_all(actuators: Any, begins: bool) -> None:
    """Reset the forces of all bottles on all axes. begins: True at the beginning of a tick."""
    if actuators is None:
        return
    for unit in range(actuators.push.shape[0]):
        for a in range(actuators.push.shape[1]):
            for column in range(actuators.push.shape[2]):
                actuators.push[unit, a, column] = 0.0
    if begins:
        for a in range(actuators.load.size):
            actuators.load[a] = 0.0


@part
def clear_push(actuators: Any, moving: MovingBodies, first: int, end: int) -> None:
    """Reset the forces of bottles first to end on the axes."""
    if actuators is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        for entry in range(moving.actives[0]):
            for column in range(actuators.push.shape[2]):
                actuators.push[unit, moving.active[entry], column] = 0.0


@part
def add_push(
    moving: MovingBodies, contacts: RailContacts, c: int, b: int, dx: float, dy: float, i: int, n: float, t: float
) -> None:
    """Add the force of contact c of bottle i on body b to its axis; n and t: N and T on the bottle, N.

    dx, dy: vector from the pivot to the contact, m.
    """
    actuators = moving.actuators
    if actuators is None:
        return
    if moving.axis[b] >= 0:
        ahead, aside = _motion_at(moving, moving.cams, contacts, c, b, dx, dy)
        actuators.push[i // UNIT, moving.axis[b], 0] += n * ahead - t * aside


@part
def add_push_parts(
    moving: MovingBodies,
    contacts: RailContacts,
    c: int,
    b: int,
    dx: float,
    dy: float,
    i: int,
    damped: float,
    drag: float,
    across: float,
) -> None:
    """Add the shares of damping and friction in that force, for the energy ledger (`add_rail_power`)."""
    actuators = moving.actuators
    if actuators is None:
        return
    if moving.axis[b] >= 0:
        ahead, aside = _motion_at(moving, moving.cams, contacts, c, b, dx, dy)
        actuators.push[i // UNIT, moving.axis[b], 1] += damped * ahead - drag * aside
        actuators.push[i // UNIT, moving.axis[b], 2] -= across * aside


@part
def _motion_at(
    moving: MovingBodies, cams: Any, contacts: RailContacts, c: int, b: int, dx: float, dy: float
) -> tuple[float, float]:
    """Return the velocity of body b at contact c along its normal and across it, over the speed of the axis."""
    ux, uy = moving.along_x[b] - moving.turning[b] * dy, moving.along_y[b] + moving.turning[b] * dx
    ux, uy = _by_cam(cams, b, ux, uy)
    return ux * contacts.nx[c] + uy * contacts.ny[c], uy * contacts.nx[c] - ux * contacts.ny[c]


@part
def _by_cam(cams: Any, b: int, ux: float, uy: float) -> tuple[float, float]:
    if cams is None:
        return ux, uy
    rate, aside_rate = cams.rate[b], cams.aside_rate[b]
    return rate * ux + aside_rate * cams.across_x[b], rate * uy + aside_rate * cams.across_y[b]


@part
def is_off_profile(actuators: Any, q: int) -> bool:
    """Return True if rail q is a body that its drive pushes with limited force."""
    if actuators is None:
        return False
    return actuators.mode[q] == OFF_PROFILE


@part
def drive_axes(actuators: Any, moving: MovingBodies, ledger: Any, time: float, dt: float, centred: bool) -> None:
    """Determine which axes can follow their profiles from a time (s) on, and move the others by a step of dt (s).

    The forces of bottles are those of the last evaluation, at the same time. centred: velocity Verlet, which has
    evaluated them at a predicted speed; else semi-implicit Euler, as for bottles.
    """
    if actuators is None:
        return
    for entry in range(moving.actives[0]):
        a = moving.active[entry]
        push = 0.0
        for unit in range(actuators.push.shape[0]):
            push += actuators.push[unit, a, 0]
        actuators.load[a] += push
        if actuators.mode[a] != HELD:
            if actuators.mode[a] == ON_PROFILE:
                acceleration = _leave_profile(actuators, moving, a, push, time)
            elif _is_endless(actuators, a):
                acceleration = _rejoin_speed(actuators, moving, ledger, a, push, time, dt)
            else:
                acceleration = _rejoin_profile(actuators, moving, ledger, a, push, time, dt, centred)
            if actuators.mode[a] == OFF_PROFILE:
                _move(actuators, moving, ledger, a, acceleration, dt, centred)


@part
def _is_endless(actuators: Actuators, a: int) -> bool:
    return actuators.low[a] < 0.0


@part
def _leave_profile(actuators: Actuators, moving: MovingBodies, a: int, push: float, time: float) -> float:
    """Leave the profile if the drive can't follow it; return the possible acceleration."""
    wanted = moving.course[a, phase_at(moving.course, a, time), 3]
    acceleration = _possible(actuators, moving, a, wanted, push)
    if acceleration != wanted:
        leave_profile(actuators, moving, a)
        actuators.acceleration[a] = acceleration
    return acceleration


@part
def overloads(actuators: Actuators, moving: MovingBodies, a: int, push: float, time: float) -> bool:
    """Return True if an axis on its profile can't follow it at a time (s) against a push."""
    wanted = moving.course[a, phase_at(moving.course, a, time), 3]
    return _possible(actuators, moving, a, wanted, push) != wanted


@part
def leave_profile(actuators: Actuators, moving: MovingBodies, a: int) -> None:
    """Take an axis off its profile."""
    actuators.mode[a], actuators.left[a] = OFF_PROFILE, 1
    moving.resting[a] = 0


@part
def _rejoin_profile(
    actuators: Actuators, moving: MovingBodies, ledger: Any, a: int, push: float, time: float, dt: float, centred: bool
) -> float:
    """Start a profile if the drive can follow it; return the possible acceleration."""
    target, most, braking = moving.course[a, PHASES - 1, 1], actuators.max_speed[a], actuators.max_acceleration[a]
    position, speed = moving.position[a], moving.speed[a]
    wanted = wanted_acceleration(position, speed, target, most, braking)
    acceleration = _possible(actuators, moving, a, wanted, push)
    if acceleration == wanted:
        correction = _correction(actuators, a, acceleration, dt, centred)
        speed += correction
        # A profile respects the speed limit, and reverses before the end stops.
        if abs(speed) <= most and actuators.low[a] <= stopping_place(position, speed, braking) <= actuators.stroke[a]:
            _book(ledger, actuators, a, dt * correction)
            plan_profile(moving.course, a, time, position, speed, target, most, braking)
            actuators.mode[a], actuators.left[a] = ON_PROFILE, 1
    return acceleration


@part
def _rejoin_speed(
    actuators: Actuators, moving: MovingBodies, ledger: Any, a: int, push: float, time: float, dt: float
) -> float:
    """Follow the profile again from the position of an endless axis if its speed is in reach within a step.

    Return the possible acceleration.
    """
    k = phase_at(moving.course, a, time)
    since, planned = time - moving.course[a, k, 0], moving.course[a, k, 3]
    wanted, missing, most = _for_speed(actuators, moving, a, k, since, dt)
    acceleration = _possible(actuators, moving, a, wanted, push)
    if acceleration == wanted and abs(missing) <= most * dt:
        _book(ledger, actuators, a, dt * missing)
        there = moving.course[a, k, 1] + (moving.course[a, k, 2] + 0.5 * planned * since) * since
        for phase in range(PHASES):
            moving.course[a, phase, 1] += moving.position[a] - there
        actuators.mode[a], actuators.left[a] = ON_PROFILE, 1
    return acceleration


@part
def _for_speed(
    actuators: Actuators, moving: MovingBodies, a: int, k: int, since: float, dt: float
) -> tuple[float, float, float]:
    """Return the wanted acceleration of an endless axis, the speed that it lacks, and its largest acceleration."""
    planned = moving.course[a, k, 3]
    target = moving.course[a, k, 2] + planned * since
    missing, most = target - moving.speed[a], max(actuators.max_acceleration[a], abs(planned))
    return min(max(planned + missing / dt, -most), most), missing, most


@part
def wanted_speed(actuators: Actuators, moving: MovingBodies, a: int, time: float, dt: float) -> float:
    """Return the speed that an axis off its profile should have after a step of dt (s) that begins at a time (s)."""
    if _is_endless(actuators, a):
        k = phase_at(moving.course, a, time)
        wanted, _, _ = _for_speed(actuators, moving, a, k, time - moving.course[a, k, 0], dt)
    else:
        target, most, braking = moving.course[a, PHASES - 1, 1], actuators.max_speed[a], actuators.max_acceleration[a]
        wanted = wanted_acceleration(moving.position[a], moving.speed[a], target, most, braking)
    return moving.speed[a] + dt * wanted


@part
def _possible(actuators: Actuators, moving: MovingBodies, a: int, wanted: float, push: float) -> float:
    """Return the acceleration nearest to the wanted one that drive and end stops permit against a push."""
    limit, mass = actuators.limit[a], actuators.mass[a]
    acceleration = min(max(wanted, (push - limit) / mass), (push + limit) / mass)
    if moving.position[a] <= actuators.low[a] and moving.speed[a] <= 0.0 and acceleration < min(wanted, 0.0):
        return min(wanted, 0.0)
    if moving.position[a] >= actuators.stroke[a] and moving.speed[a] >= 0.0 and acceleration > max(wanted, 0.0):
        return max(wanted, 0.0)
    return acceleration


@part
def _correction(actuators: Actuators, a: int, acceleration: float, dt: float, centred: bool) -> float:
    """Return the correction of the predicted speed, now that the acceleration is known."""
    return 0.5 * dt * (acceleration - actuators.acceleration[a]) if centred else 0.0


@part
def _move(
    actuators: Actuators, moving: MovingBodies, ledger: Any, a: int, acceleration: float, dt: float, centred: bool
) -> None:
    position, speed, stroke = moving.position[a], moving.speed[a], actuators.stroke[a]
    if centred:
        correction = _correction(actuators, a, acceleration, dt, centred)
        position += dt * (speed + correction + 0.5 * dt * acceleration)
        speed += correction + dt * acceleration
        _book(ledger, actuators, a, dt * correction)
    else:
        speed += dt * acceleration
        position += dt * speed
        # `_book` uses the speed before the step. The work of a kick needs the mean of the speeds before and after it.
        _book(ledger, actuators, a, 0.5 * dt * dt * acceleration)
    if position <= actuators.low[a]:
        position, speed = actuators.low[a], max(speed, 0.0)
    elif position >= stroke:
        position, speed = stroke, min(speed, 0.0)
    moving.position[a], moving.speed[a] = position, speed
    actuators.acceleration[a], actuators.left[a] = acceleration, 1


@part
def _book(ledger: Any, actuators: Actuators, a: int, displacement: float) -> None:
    """Add the work of axis a over a displacement (m) that has not been booked."""
    if ledger is None:
        return
    push = damped = rubbed = 0.0
    for unit in range(actuators.push.shape[0]):
        push += actuators.push[unit, a, 0]
        damped += actuators.push[unit, a, 1]
        rubbed += actuators.push[unit, a, 2]
    ledger.work[0, BELTS + ledger.belt_power.shape[1] + actuators.account[a]] -= push * displacement
    ledger.work[0, DAMPING] -= damped * displacement
    ledger.work[0, CONTACT_FRICTION] -= rubbed * displacement

# SPDX-License-Identifier: Apache-2.0
"""Drives of moving rails, with limited force: a rail follows its profile, or is a body that bottles can hold up.

While its drive can exert the force that the profile needs, M a minus the force of the bottles, the rail is on its
profile. Otherwise the rail is a body of mass M between the end stops, M a = F + Q. F is within the limit, as near as
possible to the force for the fastest motion to the target; Q is the sum of the bottles' forces. As soon as the limit
suffices again, a new profile starts at the rail's position. The bottles' forces are summed by units of bottles in their
order, then unit by unit, so the sum does not depend on the threads.

For a rail that swings, force, mass and m stand for torque, moment of inertia and rad.
"""

from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.moving import HELD, OFF_PROFILE, ON_PROFILE, PHASES, Actuators, MovingRails
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.observers.ledger import BELTS, CONTACT_FRICTION, DAMPING
from conveyor_sim.engine.rails.motion_profile import phase_at, plan_profile, stopping_place, wanted_acceleration
from conveyor_sim.engine.threads.workers import UNIT, units


@part
def clear_push(actuators: Any, first: int, end: int) -> None:
    """Reset the forces of bottles first to end on the rails."""
    if actuators is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        for q in range(actuators.push.shape[1]):
            for column in range(actuators.push.shape[2]):
                actuators.push[unit, q, column] = 0.0


@part
def add_push(
    moving: MovingRails, contacts: RailContacts, c: int, q: int, bottles: Bottles, i: int, n: float, t: float
) -> None:
    """Add the force of contact c of bottle i on rail q along its motion; n and t: N and T on the bottle, N."""
    actuators = moving.actuators
    if actuators is None:
        return
    ahead, aside = _motion_at(moving, contacts, c, q, bottles, i)
    actuators.push[i // UNIT, q, 0] += n * ahead - t * aside


@part
def add_push_parts(
    moving: MovingRails,
    contacts: RailContacts,
    c: int,
    q: int,
    bottles: Bottles,
    i: int,
    damped: float,
    drag: float,
    across: float,
) -> None:
    """Add the shares of damping and friction in that force, for the energy ledger (`add_rail_power`)."""
    actuators = moving.actuators
    if actuators is None:
        return
    ahead, aside = _motion_at(moving, contacts, c, q, bottles, i)
    actuators.push[i // UNIT, q, 1] += damped * ahead - drag * aside
    actuators.push[i // UNIT, q, 2] -= across * aside


@part
def _motion_at(
    moving: MovingRails, contacts: RailContacts, c: int, q: int, bottles: Bottles, i: int
) -> tuple[float, float]:
    """Return the velocity of rail q at contact c along its normal and across it, over the speed of the rail."""
    arm = bottles.radius[i] - contacts.overlap[c]
    dx = bottles.x[i] + arm * contacts.nx[c] - moving.x[q]
    dy = bottles.y[i] + arm * contacts.ny[c] - moving.y[q]
    ux, uy = moving.along_x[q] - moving.turning[q] * dy, moving.along_y[q] + moving.turning[q] * dx
    return ux * contacts.nx[c] + uy * contacts.ny[c], uy * contacts.nx[c] - ux * contacts.ny[c]


@part
def is_off_profile(actuators: Any, q: int) -> bool:
    """Return True if rail q is a body that its drive pushes with limited force."""
    if actuators is None:
        return False
    return actuators.mode[q] == OFF_PROFILE


@part
def drive_rails(actuators: Any, moving: MovingRails, ledger: Any, time: float, dt: float, centred: bool) -> None:
    """Determine which rails can follow their profiles from a time (s) on, and move the others by a step of dt (s).

    The forces of bottles are those of the last evaluation, at the same time. centred: velocity Verlet, which has
    evaluated them at a predicted speed; else semi-implicit Euler, as for bottles.
    """
    if actuators is None:
        return
    for q in range(actuators.mode.size):
        if actuators.mode[q] == HELD:
            continue
        push = 0.0
        for unit in range(actuators.push.shape[0]):
            push += actuators.push[unit, q, 0]
        if actuators.mode[q] == ON_PROFILE:
            acceleration = _leave_profile(actuators, moving, q, push, time)
        else:
            acceleration = _rejoin_profile(actuators, moving, ledger, q, push, time, dt, centred)
        if actuators.mode[q] == OFF_PROFILE:
            _move(actuators, moving, ledger, q, acceleration, dt, centred)


@part
def _leave_profile(actuators: Actuators, moving: MovingRails, q: int, push: float, time: float) -> float:
    """Leave the profile if the drive can't follow it; return the possible acceleration."""
    wanted = moving.course[q, phase_at(moving.course, q, time), 3]
    acceleration = _possible(actuators, moving, q, wanted, push)
    if acceleration != wanted:
        actuators.mode[q], actuators.left[q] = OFF_PROFILE, 1
        actuators.acceleration[q] = acceleration
    return acceleration


@part
def _rejoin_profile(
    actuators: Actuators, moving: MovingRails, ledger: Any, q: int, push: float, time: float, dt: float, centred: bool
) -> float:
    """Start a profile if the drive can follow it; return the possible acceleration."""
    target, most, braking = moving.course[q, PHASES - 1, 1], actuators.max_speed[q], actuators.max_acceleration[q]
    position, speed = moving.position[q], moving.speed[q]
    wanted = wanted_acceleration(position, speed, target, most, braking)
    acceleration = _possible(actuators, moving, q, wanted, push)
    if acceleration == wanted:
        correction = _correction(actuators, q, acceleration, dt, centred)
        speed += correction
        # A profile respects the speed limit, and reverses before the end stops.
        if abs(speed) <= most and 0.0 <= stopping_place(position, speed, braking) <= actuators.stroke[q]:
            _book(ledger, actuators, q, dt * correction)
            plan_profile(moving.course, q, time, position, speed, target, most, braking)
            actuators.mode[q], actuators.left[q] = ON_PROFILE, 1
    return acceleration


@part
def _possible(actuators: Actuators, moving: MovingRails, q: int, wanted: float, push: float) -> float:
    """Return the acceleration nearest to the wanted one that drive and end stops permit against a push."""
    limit, mass = actuators.limit[q], actuators.mass[q]
    acceleration = min(max(wanted, (push - limit) / mass), (push + limit) / mass)
    if moving.position[q] <= 0.0 and moving.speed[q] <= 0.0 and acceleration < min(wanted, 0.0):
        return min(wanted, 0.0)
    if moving.position[q] >= actuators.stroke[q] and moving.speed[q] >= 0.0 and acceleration > max(wanted, 0.0):
        return max(wanted, 0.0)
    return acceleration


@part
def _correction(actuators: Actuators, q: int, acceleration: float, dt: float, centred: bool) -> float:
    """Return the correction of the predicted speed, now that the acceleration is known."""
    return 0.5 * dt * (acceleration - actuators.acceleration[q]) if centred else 0.0


@part
def _move(
    actuators: Actuators, moving: MovingRails, ledger: Any, q: int, acceleration: float, dt: float, centred: bool
) -> None:
    position, speed, stroke = moving.position[q], moving.speed[q], actuators.stroke[q]
    if centred:
        correction = _correction(actuators, q, acceleration, dt, centred)
        position += dt * (speed + correction + 0.5 * dt * acceleration)
        speed += correction + dt * acceleration
        _book(ledger, actuators, q, dt * correction)
    else:
        speed += dt * acceleration
        position += dt * speed
        # `_book` uses the speed before the step. The work of a kick needs the mean of the speeds before and after it.
        _book(ledger, actuators, q, 0.5 * dt * dt * acceleration)
    if position <= 0.0:
        position, speed = 0.0, max(speed, 0.0)
    elif position >= stroke:
        position, speed = stroke, min(speed, 0.0)
    moving.position[q], moving.speed[q] = position, speed
    actuators.acceleration[q], actuators.left[q] = acceleration, 1


@part
def _book(ledger: Any, actuators: Actuators, q: int, displacement: float) -> None:
    """Add the work of rail q over a displacement (m) that has not been booked."""
    if ledger is None:
        return
    push = damped = rubbed = 0.0
    for unit in range(actuators.push.shape[0]):
        push += actuators.push[unit, q, 0]
        damped += actuators.push[unit, q, 1]
        rubbed += actuators.push[unit, q, 2]
    ledger.work[0, BELTS + ledger.belt_power.shape[1] + q] -= push * displacement
    ledger.work[0, DAMPING] -= damped * displacement
    ledger.work[0, CONTACT_FRICTION] -= rubbed * displacement

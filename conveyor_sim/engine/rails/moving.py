# SPDX-License-Identifier: Apache-2.0
"""Moving rails: their positions at every step, their contacts, and the velocity of the rail at a contact.

A rail's motion profile is a closed form of time, constant accelerations one after another, so it moves within a tick,
and a tick can be repeated in shorter steps. It leaves its profile if bottles overload its drive (`actuators.py`). A
contact identifies a moving rail by an entry of MOVING or more. There are few moving rails. So every bottle near the box
that a rail sweeps tests it, and no list depends on the rail's position.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.moving import MovingRails
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.rails.actuators import add_push, add_push_parts, clear_push, drive_rails, is_off_profile
from conveyor_sim.engine.rails.deepest_contacts import keep_deepest
from conveyor_sim.engine.rails.motion_profile import phase_at
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import UNIT, units, wait_for_all

MOVING = 1 << 40
"""Offset of the number of a moving rail in `RailContacts.entry`."""


@part
def place_rails(moving: Any, worker: Worker, dt: float) -> None:
    """Move the rails to their positions at time `clock` x dt of the tick. dt: step, s.

    Other workers see the new positions after the next `wait_for_all`.
    """
    if moving is None:
        return
    if worker.rank == 0:
        _place(moving, moving.clock[0] * dt)


@part
def pass_step(moving: Any, ledger: Any, worker: Worker, dt: float, centred: bool) -> None:
    """Move the rails by a step, right after a `wait_for_all`; on return all see it. centred: see `drive_rails`."""
    if moving is None:
        return
    if worker.rank == 0:
        _note_path(moving, moving.springs, -1.0)
        drive_rails(moving.actuators, moving, ledger, moving.clock[0] * dt, dt, centred)
        moving.clock[0] += 1.0
        _place(moving, moving.clock[0] * dt)
        _note_path(moving, moving.springs, 1.0)
    wait_for_all(worker)


@part
def _note_path(moving: MovingRails, springs: Any, sign: float) -> None:
    """Update displacements. Called before and after a step, because they are differences of positions."""
    if springs is None:
        return
    for q in range(moving.x.size):
        springs.path[q] = (springs.path[q] if sign > 0.0 else 0.0) + sign * moving.position[q]


@part
def _place(moving: MovingRails, time: float) -> None:
    for q in range(moving.x.size):
        position, speed = moving.position[q], moving.speed[q]
        if not is_off_profile(moving.actuators, q):
            k = phase_at(moving.course, q, time)
            since, acceleration = time - moving.course[q, k, 0], moving.course[q, k, 3]
            position = moving.course[q, k, 1] + (moving.course[q, k, 2] + 0.5 * acceleration * since) * since
            speed = moving.course[q, k, 2] + acceleration * since
        cosine, sine = math.cos(moving.turning[q] * position), math.sin(moving.turning[q] * position)
        x = moving.home_x[q] + moving.along_x[q] * position
        y = moving.home_y[q] + moving.along_y[q] * position
        tx = moving.home_tx[q] * cosine - moving.home_ty[q] * sine
        ty = moving.home_tx[q] * sine + moving.home_ty[q] * cosine
        moving.x[q], moving.y[q], moving.tx[q], moving.ty[q] = x, y, tx, ty
        moving.ends.x[q, 0], moving.ends.y[q, 0] = x, y
        moving.ends.x[q, 1], moving.ends.y[q, 1] = x + moving.length[q] * tx, y + moving.length[q] * ty
        moving.vx[q], moving.vy[q] = moving.along_x[q] * speed, moving.along_y[q] * speed
        moving.turn[q] = moving.turning[q] * speed
        moving.position[q], moving.speed[q] = position, speed


@part
def near_sweep(moving: Any, bottles: Bottles, i: int, margin: float) -> bool:
    """Return True if bottle i, moved by up to margin (m), can touch a rail at any of its positions."""
    if moving is None:
        return False
    if bottles.id[i] < 0:
        return False
    reach = bottles.radius[i] + margin
    for q in range(moving.x.size):
        inside_x = moving.sweep[q, 0] - reach <= bottles.x[i] <= moving.sweep[q, 2] + reach
        if inside_x and moving.sweep[q, 1] - reach <= bottles.y[i] <= moving.sweep[q, 3] + reach:
            return True
    return False


@part
def moving_contacts(i: int, bottles: Bottles, moving: Any, contacts: RailContacts, count: int) -> int:
    """Append the contacts of bottle i with moving rails to the first `count`; return their new number."""
    if moving is None:
        return count
    for q in range(moving.x.size):
        overlap, nx, ny = segment_contact(moving, q, bottles.x[i], bottles.y[i], bottles.radius[i])
        if overlap > 0.0:
            material, rail, surface = moving.material[q], moving.rail[q], moving.surface[q]
            count = keep_deepest(contacts, count, overlap, nx, ny, material, rail, surface, MOVING + q)
    return count


@part
def moves(moving: Any, entry: int) -> bool:
    """Return True if a contact is with a moving rail, by its entry."""
    if moving is None:
        return False
    return entry >= MOVING


@part
def surface_velocity(moving: Any, contacts: RailContacts, c: int, bottles: Bottles, i: int) -> tuple[float, float]:
    """Return the velocity (m/s) of the rail at contact c of bottle i; 0 for a rail at rest."""
    if moving is None:
        return 0.0, 0.0
    q = contacts.entry[c] - MOVING
    if q < 0:
        return 0.0, 0.0
    arm = bottles.radius[i] - contacts.overlap[c]
    dx = bottles.x[i] + arm * contacts.nx[c] - moving.x[q]
    dy = bottles.y[i] + arm * contacts.ny[c] - moving.y[q]
    return moving.vx[q] - moving.turn[q] * dy, moving.vy[q] + moving.turn[q] * dx


@part
def clear_rail_push(moving: Any, first: int, end: int) -> None:
    """Reset the forces of bottles first to end on moving rails."""
    if moving is None:
        return
    clear_push(moving.actuators, first, end)


@part
def add_rail_push(
    moving: Any, contacts: RailContacts, c: int, bottles: Bottles, i: int, normal: float, tangential: float
) -> None:
    """Add the force of contact c of bottle i on its rail, if it is a moving one; N and T on the bottle, N."""
    if moving is None:
        return
    q = contacts.entry[c] - MOVING
    if q < 0:
        return
    add_push(moving, contacts, c, q, bottles, i, normal, tangential)


@part
def surface_path(moving: Any, contacts: RailContacts, c: int, bottles: Bottles, i: int) -> tuple[float, float]:
    """Return the rail's displacement (m) at contact c of bottle i since springs were updated; 0 for a rail at rest."""
    if moving is None:
        return 0.0, 0.0
    q = contacts.entry[c] - MOVING
    if q < 0:
        return 0.0, 0.0
    arm, path = bottles.radius[i] - contacts.overlap[c], moving.springs.path[q]
    turned = moving.turning[q] * path
    dx = bottles.x[i] + arm * contacts.nx[c] - moving.x[q]
    dy = bottles.y[i] + arm * contacts.ny[c] - moving.y[q]
    return moving.along_x[q] * path - turned * dy, moving.along_y[q] * path + turned * dx


@part
def moving_spring(moving: Any, i: int, entry: int) -> float:
    """Return the elongation (m) of the spring of bottle i at a moving rail, by the entry of the contact."""
    if moving is None:
        return 0.0
    return moving.springs.elongation[i, entry - MOVING]


@part
def set_moving_spring(moving: Any, i: int, entry: int, elongation: float) -> None:
    """Store the elongation (m) of that spring."""
    if moving is not None:
        moving.springs.elongation[i, entry - MOVING] = elongation


@part
def reset_moving_springs(moving: Any, i: int) -> None:
    """Reset the springs of bottle i at all moving rails."""
    if moving is not None:
        for q in range(moving.x.size):
            moving.springs.elongation[i, q] = 0.0


@part
def clear_rail_power(ledger: Any, moving: Any, first: int, end: int) -> None:
    """Reset the power of the rails on bottles first to end."""
    if ledger is None:
        return
    if moving is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        for column in range(ledger.rail_power.shape[1]):
            ledger.rail_power[unit, column] = 0.0


@part
def add_rail_power(
    world: World,
    contacts: RailContacts,
    c: int,
    i: int,
    normal: float,
    tangential: float,
    damped: float,
    drag: float,
    across: float,
) -> None:
    """Add the power of the rail in contact c of bottle i: F u, and the losses by damping and friction.

    The forces are N of the contact and of its damping, T of the contact, of its drag and of its friction, all in N. A
    force F dissipates F (u - v); `ledger.py` adds F v.
    """
    moving, ledger = world.moving, world.ledger
    if moving is None:
        return
    q = contacts.entry[c] - MOVING
    if q < 0:
        return
    ux, uy = surface_velocity(moving, contacts, c, world.bottles, i)
    ahead = ux * contacts.nx[c] + uy * contacts.ny[c]
    aside = uy * contacts.nx[c] - ux * contacts.ny[c]
    unit, rails = i // UNIT, moving.x.size
    ledger.rail_power[unit, q] += tangential * aside - normal * ahead
    ledger.rail_power[unit, rails] += drag * aside - damped * ahead
    ledger.rail_power[unit, rails + 1] += across * aside
    add_push_parts(moving, contacts, c, q, world.bottles, i, damped, drag, across)

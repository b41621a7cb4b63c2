# SPDX-License-Identifier: Apache-2.0
"""Bodies under axes: their motion at every step, their contacts, and the velocity of their surface at a contact.

An axis's motion profile is a closed form of time, constant accelerations one after another, so it moves within a tick,
and a tick can be repeated in shorter steps. It leaves its profile if bottles overload its drive (`actuators.py`). A
rebuild lists the bodies whose sweep, the box of all their places, is near a bottle. So no list depends on the position
of a body. Of these bodies a bottle tests the pieces in whose circle it is (`Clusters`). A contact identifies a piece of
a body by an entry of MOVING or more.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.moving import MovingBodies
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.rails.actuators import (
    add_push,
    add_push_parts,
    clear_all,
    clear_push,
    drive_axes,
)
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.cams import is_present, rates_at
from conveyor_sim.engine.rails.deepest_contacts import keep_deepest
from conveyor_sim.engine.rails.poses import list_active, move_axes, note_resting, place_bodies
from conveyor_sim.engine.rails.sectors import cluster_at, clusters_beside
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import UNIT, units, wait_for_all

MOVING = 1 << 40
"""Offset of the number of a piece in `RailContacts.entry`."""


@part
def place_rails(moving: Any, worker: Worker, dt: float) -> None:
    """Move axes and bodies to their positions at time `clock` x dt of the tick. dt: step, s.

    Other workers see the new positions after the next `wait_for_all`.
    """
    if moving is None:
        return
    if worker.rank == 0:
        clear_all(moving.actuators, moving.clock[0] == 0.0)
        note_resting(moving)
        list_active(moving)
        move_axes(moving, moving.clock[0] * dt)
        place_bodies(moving, True)


@part
def pass_step(moving: Any, ledger: Any, worker: Worker, dt: float, centred: bool) -> None:
    """Move the bodies by a step, right after a `wait_for_all`; on return all see it. centred: see `drive_axes`."""
    if moving is None:
        return
    if worker.rank == 0:
        _note_path(moving, moving.springs, moving.cams, dt, -1.0)
        drive_axes(moving.actuators, moving, ledger, moving.clock[0] * dt, dt, centred)
        moving.clock[0] += 1.0
        move_axes(moving, moving.clock[0] * dt)
        place_bodies(moving, False)
        _note_path(moving, moving.springs, moving.cams, dt, 1.0)
    wait_for_all(worker)


@part
def _note_path(moving: MovingBodies, springs: Any, cams: Any, dt: float, sign: float) -> None:
    """Update displacements. Called before and after a step, because they are differences of positions."""
    if springs is None:
        return
    springs.elapsed[0] = dt
    for entry in range(moving.nears[0]):
        b = moving.near[entry]
        springs.path[b] = (springs.path[b] if sign > 0.0 else 0.0) + sign * moving.pose.displacement[b]
        _note_slide(springs, cams, b, sign)


@part
def _note_slide(springs: Any, cams: Any, b: int, sign: float) -> None:
    if cams is None:
        return
    springs.aside[b] = (springs.aside[b] if sign > 0.0 else 0.0) + sign * cams.aside[b]
    # A body that was absent has come from elsewhere: NaN until the end of the step, then no displacement.
    if sign < 0.0:
        if not is_present(cams, b):
            springs.path[b] = math.nan
    elif math.isnan(springs.path[b]):
        springs.path[b] = springs.aside[b] = 0.0


@part
def moving_contacts(
    i: int, bottles: Bottles, moving: Any, near: Any, margin: float, contacts: RailContacts, count: int
) -> int:
    """Append the contacts of bottle i with bodies to the first `count`; return their new number.

    margin: m, added to its radius; overlaps contain it.
    """
    if near is None:
        return count
    clusters, radius = moving.clusters, bottles.radius[i] + margin
    for entry in range(near.start[i], near.start[i + 1]):
        b = near.piece[entry]
        if is_present(moving.cams, b):
            x, y = seen_from(moving, b, bottles.x[i], bottles.y[i])
            begin, end = clusters_beside(moving, moving.sectors, b, x, y)
            for place in range(begin, end):
                k = cluster_at(moving.sectors, place)
                dx, dy, reach = clusters.x[k] - x, clusters.y[k] - y, clusters.radius[k] + radius
                if dx * dx + dy * dy <= reach * reach:
                    count = _segment_contacts(
                        moving, moving.segments, k, bottles.x[i], bottles.y[i], radius, contacts, count
                    )
                    count = _arc_contacts(moving, moving.arcs, b, k, x, y, radius, contacts, count)
    return count


@part
def seen_from(moving: MovingBodies, b: int, x: float, y: float) -> tuple[float, float]:
    """Return a place (m) in the frame of body b."""
    pose = moving.pose
    dx, dy, cosine, sine = x - pose.x[b], y - pose.y[b], pose.cosine[b], pose.sine[b]
    return dx * cosine + dy * sine, dy * cosine - dx * sine


@part
def _segment_contacts(
    moving: MovingBodies,
    segments: Any,
    k: int,
    x: float,
    y: float,
    radius: float,
    contacts: RailContacts,
    count: int,
) -> int:
    """Append the contacts of a bottle at (x, y) with the straight pieces of cluster k."""
    if segments is None:
        return count
    for g in range(moving.clusters.segment[k], moving.clusters.segment[k + 1]):
        overlap, nx, ny = segment_contact(segments, g, x, y, radius)
        if overlap > 0.0:
            material, rail, surface = segments.material[g], segments.rail[g], segments.surface[g]
            count = keep_deepest(contacts, count, overlap, nx, ny, material, rail, surface, MOVING + g)
    return count


@part
def _arc_contacts(
    moving: MovingBodies,
    arcs: Any,
    b: int,
    k: int,
    x: float,
    y: float,
    radius: float,
    contacts: RailContacts,
    count: int,
) -> int:
    """Append the contacts with the arcs of cluster k of a bottle at (x, y) in the frame of body b."""
    if arcs is None:
        return count
    first, cosine, sine = _count(moving.segments), moving.pose.cosine[b], moving.pose.sine[b]
    for g in range(moving.clusters.arc[k], moving.clusters.arc[k + 1]):
        overlap, mx, my = arc_contact(arcs, g, x, y, radius)
        if overlap > 0.0:
            nx, ny = mx * cosine - my * sine, mx * sine + my * cosine
            material, rail, surface = arcs.material[g], arcs.rail[g], arcs.surface[g]
            count = keep_deepest(contacts, count, overlap, nx, ny, material, rail, surface, MOVING + first + g)
    return count


@part
def piece_contact(moving: MovingBodies, q: int, x: float, y: float, radius: float) -> tuple[float, float, float, int]:
    """Return the overlap (m) of a circle with piece q of a body, the unit normal to it, and its rail; 0 or less: none.

    A body that is absent is not touched.
    """
    b, straight = moving.body[q], _count(moving.segments)
    if not is_present(moving.cams, b):
        return 0.0, 0.0, 0.0, 0
    if q < straight:
        return _straight_contact(moving.segments, q, x, y, radius)
    x, y = seen_from(moving, b, x, y)
    overlap, mx, my, rail = _bent_contact(moving.arcs, q - straight, x, y, radius)
    cosine, sine = moving.pose.cosine[b], moving.pose.sine[b]
    return overlap, mx * cosine - my * sine, mx * sine + my * cosine, rail


@part
def _straight_contact(segments: Any, g: int, x: float, y: float, radius: float) -> tuple[float, float, float, int]:
    if segments is None:
        return 0.0, 0.0, 0.0, 0
    overlap, nx, ny = segment_contact(segments, g, x, y, radius)
    return overlap, nx, ny, segments.rail[g]


@part
def _bent_contact(arcs: Any, k: int, x: float, y: float, radius: float) -> tuple[float, float, float, int]:
    if arcs is None:
        return 0.0, 0.0, 0.0, 0
    overlap, nx, ny = arc_contact(arcs, k, x, y, radius)
    return overlap, nx, ny, arcs.rail[k]


@part
def _count(segments: Any) -> int:
    """Return the number of straight pieces, after which arcs are numbered."""
    if segments is None:
        return 0
    return segments.x.size


@part
def moves(moving: Any, entry: int) -> bool:
    """Return True if a contact is with a body, by its entry."""
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
    b, pose = moving.body[q], moving.pose
    dx, dy = _arm(moving, contacts, c, b, bottles, i)
    ux, uy = pose.vx[b] - pose.turn[b] * dy, pose.vy[b] + pose.turn[b] * dx
    return _with_surface(moving, moving.surface_speed, contacts, c, b, bottles, i, ux, uy, 1.0)


@part
def belt_speed(moving: MovingBodies, contacts: RailContacts, c: int, bottles: Bottles, i: int) -> float:
    """Return the speed (m/s) at which the surface of a body runs along itself at contact c of bottle i."""
    b = moving.body[contacts.entry[c] - MOVING]
    ux, uy = _with_surface(moving, moving.surface_speed, contacts, c, b, bottles, i, 0.0, 0.0, 1.0)
    return uy * contacts.nx[c] - ux * contacts.ny[c]


@part
def mean_motion(
    moving: MovingBodies, contacts: RailContacts, c: int, dx: float, dy: float, h: float
) -> tuple[float, float]:
    """Return the velocity of a body at contact c along its normal and across it, over the speed of its axis.

    It is that in the middle of the next h (s), so that the displacement in this time is exact to order 3. dx, dy:
    vector from the pivot to the contact, m.
    """
    b = moving.body[contacts.entry[c] - MOVING]
    half = 0.5 * h * moving.pose.turn[b]
    dx, dy = dx - half * dy, dy + half * dx
    ux, uy = moving.along_x[b] - moving.turning[b] * dy, moving.along_y[b] + moving.turning[b] * dx
    ux, uy = _by_mean_rate(moving, moving.cams, b, ux, uy, h)
    return ux * contacts.nx[c] + uy * contacts.ny[c], uy * contacts.nx[c] - ux * contacts.ny[c]


@part
def _by_mean_rate(moving: MovingBodies, cams: Any, b: int, ux: float, uy: float, h: float) -> tuple[float, float]:
    if cams is None:
        return ux, uy
    a = moving.axis[b]
    rate, aside_rate = rates_at(cams, b, moving.position[a] - moving.lag[b] + 0.5 * h * moving.speed[a])
    return rate * ux + aside_rate * cams.across_x[b], rate * uy + aside_rate * cams.across_y[b]


@part
def _arm(moving: MovingBodies, contacts: RailContacts, c: int, b: int, bottles: Bottles, i: int) -> tuple[float, float]:
    """Return the vector from the pivot of body b to contact c of bottle i, m."""
    arm = bottles.radius[i] - contacts.overlap[c]
    dx = bottles.x[i] + arm * contacts.nx[c] - moving.pose.x[b]
    dy = bottles.y[i] + arm * contacts.ny[c] - moving.pose.y[b]
    return dx, dy


@part
def _with_surface(
    moving: MovingBodies,
    speeds: Any,
    contacts: RailContacts,
    c: int,
    b: int,
    bottles: Bottles,
    i: int,
    x: float,
    y: float,
    time: float,
) -> tuple[float, float]:
    """Add the path of the surface in a time (s) at contact c of bottle i to a displacement (m).

    A belt runs round the ends of its rail, so its surface never moves along the normal.
    """
    if speeds is None:
        return x, y
    if speeds[b] == 0.0:
        return x, y
    q = contacts.entry[c] - MOVING
    nx, ny = contacts.nx[c], contacts.ny[c]
    at_x, at_y = bottles.x[i] + bottles.radius[i] * nx, bottles.y[i] + bottles.radius[i] * ny
    tx, ty = _tangent(moving, b, q, at_x, at_y)
    path = speeds[b] * time if ty * nx >= tx * ny else -speeds[b] * time
    return x - path * ny, y + path * nx


@part
def _tangent(moving: MovingBodies, b: int, q: int, x: float, y: float) -> tuple[float, float]:
    """Return a vector along piece q of body b at a point (m), from its first to its last end."""
    straight = _count(moving.segments)
    if q < straight:
        return _along_segment(moving.segments, q)
    x, y = seen_from(moving, b, x, y)
    tx, ty = _along_arc(moving.arcs, q - straight, x, y)
    cosine, sine = moving.pose.cosine[b], moving.pose.sine[b]
    return tx * cosine - ty * sine, tx * sine + ty * cosine


@part
def _along_segment(segments: Any, g: int) -> tuple[float, float]:
    if segments is None:
        return 0.0, 0.0
    return segments.tx[g], segments.ty[g]


@part
def _along_arc(arcs: Any, k: int, x: float, y: float) -> tuple[float, float]:
    if arcs is None:
        return 0.0, 0.0
    return arcs.y[k] - y, x - arcs.x[k]


@part
def clear_rail_push(moving: Any, first: int, end: int) -> None:
    """Reset the forces of bottles first to end on axes."""
    if moving is None:
        return
    clear_push(moving.actuators, moving, first, end)


@part
def add_rail_push(
    moving: Any, contacts: RailContacts, c: int, bottles: Bottles, i: int, normal: float, tangential: float
) -> None:
    """Add the force of contact c of bottle i on its rail, if it is that of a body; N and T on the bottle, N."""
    if moving is None:
        return
    q = contacts.entry[c] - MOVING
    if q < 0:
        return
    b = moving.body[q]
    dx, dy = _arm(moving, contacts, c, b, bottles, i)
    add_push(moving, contacts, c, b, dx, dy, i, normal, tangential)


@part
def surface_path(moving: Any, contacts: RailContacts, c: int, bottles: Bottles, i: int) -> tuple[float, float]:
    """Return the rail's displacement (m) at contact c of bottle i since springs were updated; 0 for a rail at rest."""
    if moving is None:
        return 0.0, 0.0
    q = contacts.entry[c] - MOVING
    if q < 0:
        return 0.0, 0.0
    b = moving.body[q]
    path = moving.springs.path[b]
    turned = moving.turning[b] * path
    dx, dy = _arm(moving, contacts, c, b, bottles, i)
    x, y = moving.along_x[b] * path - turned * dy, moving.along_y[b] * path + turned * dx
    x, y = _with_slide(moving.springs, moving.cams, b, x, y)
    return _with_surface(moving, moving.surface_speed, contacts, c, b, bottles, i, x, y, moving.springs.elapsed[0])


@part
def _with_slide(springs: Any, cams: Any, b: int, x: float, y: float) -> tuple[float, float]:
    if cams is None:
        return x, y
    return x + cams.across_x[b] * springs.aside[b], y + cams.across_y[b] * springs.aside[b]


@part
def moving_spring(moving: Any, i: int, entry: int) -> float:
    """Return the elongation (m) of the spring of bottle i at a body, by the entry of the contact."""
    if moving is None:
        return 0.0
    return moving.springs.elongation[i, moving.springs.column[entry - MOVING]]


@part
def set_moving_spring(moving: Any, i: int, entry: int, elongation: float) -> None:
    """Store the elongation (m) of that spring."""
    if moving is not None:
        moving.springs.elongation[i, moving.springs.column[entry - MOVING]] = elongation


@part
def reset_moving_springs(moving: Any, near: Any, i: int) -> None:
    """Reset the springs of bottle i at all bodies near it."""
    if near is not None:
        for entry in range(near.start[i], near.start[i + 1]):
            b = near.piece[entry]
            for column in range(moving.springs.first[b], moving.springs.first[b + 1]):
                moving.springs.elongation[i, column] = 0.0


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
    unit, rails = i // UNIT, ledger.rail_power.shape[1] - 2
    ledger.rail_power[unit, moving.account[moving.body[q]]] += tangential * aside - normal * ahead
    ledger.rail_power[unit, rails] += drag * aside - damped * ahead
    ledger.rail_power[unit, rails + 1] += across * aside
    b = moving.body[q]
    dx, dy = _arm(moving, contacts, c, b, world.bottles, i)
    add_push_parts(moving, contacts, c, b, dx, dy, i, damped, drag, across)

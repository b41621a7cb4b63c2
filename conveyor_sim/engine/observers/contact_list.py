# SPDX-License-Identifier: Apache-2.0
"""All closed contacts as columns, by the functions that compute the forces; read-only."""

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.contact import contact_force
from conveyor_sim.engine.contact.pairs import elongation, normal_and_overlap
from conveyor_sim.engine.impulses.contact_list import list_impulses
from conveyor_sim.engine.rails.rails import find_rail_contacts, rail_contact, rail_elongation
from conveyor_sim.engine.world_views import contacts_of

BOTTLE_BOTTLE, BOTTLE_RAIL = 0, 1


@kernel
def list_contacts(world: World, contacts: RailContacts, kind: NDArray[np.uint8], a: I8, b: I8, values: F8) -> int:
    """Write the contacts of the present state; return their number, which may exceed the length of the columns.

    contacts: scratch. kind: (C,). a, b: (C,), slots, or b the rail. values: (7, C): x, y (m), normal x, y, overlap
    (m), N, T (N). The neighbour lists must hold. Friction that is solved implicitly is listed by the explicit law.
    """
    return _rail_contacts(world, contacts, kind, a, b, values, _pair_contacts(world, kind, a, b, values))


@part
def _pair_contacts(world: World, kind: NDArray[np.uint8], a: I8, b: I8, values: F8) -> int:
    bottles, pairs = world.bottles, world.pairs
    if pairs is None:
        return 0
    count = 0
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        reach = bottles.radius[i] + bottles.radius[j]
        overlap, nx, ny = normal_and_overlap(bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i], reach)
        if overlap > 0.0:
            if count < kind.size:
                normal, tangential, _ = pair_contact(world, p, overlap, nx, ny)
                kind[count] = BOTTLE_BOTTLE
                a[count] = i
                b[count] = j
                arm = bottles.radius[i] - 0.5 * overlap
                _write_point(values, count, bottles, i, arm * nx, arm * ny)
                _write_force(values, count, nx, ny, overlap, normal, tangential)
            count += 1
    return count


@part
def pair_contact(world: World, p: int, overlap: float, nx: float, ny: float) -> tuple[float, float, float]:
    """Return N and T (N) on the first bottle of pair p, and its slip (m/s); the normal points to the other bottle."""
    settings, bottles, spin, pairs = world.settings, world.bottles, world.spin, world.pairs
    i, j = pairs.i[p], pairs.j[p]
    vx = bottles.vx[i] - bottles.vx[j]
    vy = bottles.vy[i] - bottles.vy[j]
    slip = -vx * ny + vy * nx
    if spin is not None:
        shorter = 0.5 * settings.lever * overlap
        slip += spin.omega[i] * (bottles.radius[i] - shorter) + spin.omega[j] * (bottles.radius[j] - shorter)
    closing = vx * nx + vy * ny
    limit, atan, spring = settings.slip_limit, settings.atan, elongation(pairs.spring, p)
    normal, tangential = contact_force(
        pairs.law, p, world.curves, limit, atan, overlap, 1.0, closing, slip, spring, None
    )
    return normal, tangential, slip


@part
def _rail_contacts(
    world: World, contacts: RailContacts, kind: NDArray[np.uint8], a: I8, b: I8, values: F8, count: int
) -> int:
    bottles = world.bottles
    if world.rail_law is None:
        return count
    for i in range(bottles.x.size):
        for c in range(find_rail_contacts(i, world, contacts)):
            if contacts.share[c] > 0.0:
                if count < kind.size:
                    spring = rail_elongation(world, i, contacts.entry[c])
                    normal, tangential, _, _, _ = rail_contact(c, i, world, contacts, spring, 0.0, None, None)
                    nx, ny, overlap = contacts.nx[c], contacts.ny[c], contacts.overlap[c]
                    kind[count] = BOTTLE_RAIL
                    a[count] = i
                    b[count] = contacts.rail[c]
                    arm = bottles.radius[i] - overlap
                    _write_point(values, count, bottles, i, arm * nx, arm * ny)
                    _write_force(values, count, nx, ny, overlap, normal, tangential)
                count += 1
    return count


@part
def _write_point(values: F8, c: int, bottles: Bottles, i: int, x: float, y: float) -> None:
    """Write the contact point. x, y: from the axis of bottle i, m."""
    values[0, c] = bottles.x[i] + x
    values[1, c] = bottles.y[i] + y


@part
def _write_force(values: F8, c: int, nx: float, ny: float, overlap: float, normal: float, tangential: float) -> None:
    values[2, c] = nx
    values[3, c] = ny
    values[4, c] = overlap
    values[5, c] = normal
    values[6, c] = tangential


def closed_contacts(world: World, contacts: RailContacts) -> tuple[NDArray[np.uint8], I8, F8]:
    """Return every closed contact of the present state as in `list_contacts`: kind (C,), ends (2, C), values (7, C)."""
    view, room = contacts_of(world), 64
    while True:
        kind, ends, values = np.zeros(room, np.uint8), np.zeros((2, room), np.int64), np.zeros((7, room))
        if world.impulses is None:
            count = list_contacts(view, contacts, kind, ends[0], ends[1], values)
        else:
            count = list_impulses(world, kind, ends[0], ends[1], values)
        if count <= room:
            return kind[:count], ends[:, :count], values[:, :count]
        room = count

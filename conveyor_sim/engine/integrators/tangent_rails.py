# SPDX-License-Identifier: Apache-2.0
"""Contacts of bottles with rails in the linearly implicit method (`tangent.py`)."""

from typing import Any

from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.integrators.tangent import contact_stiffness, linear_contact
from conveyor_sim.engine.integrators.tangent_pairs import add_block
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.deepest_contacts import law_entry, rail_arm
from conveyor_sim.engine.rails.rails import find_rail_contacts
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import UNIT, units


@part
def stiffest_rails(world: World, contacts: RailContacts, first: int, end: int) -> None:
    """Write to `linear.most`, for each unit of bottles first to end, the largest stiffness over mass (1/s^2).

    It is the maximum over the contacts with rails that are closed at `bottles.x`.
    """
    bottles, linear, railed = world.bottles, world.linear, world.railed
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        linear.most[unit] = 0.0
    if railed is None:
        return
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        most = linear.most[i // UNIT]
        for c in range(find_rail_contacts(i, world, contacts)):
            entry = law_entry(world, contacts, c, i)
            stiffness = contact_stiffness(world, world.rail_law, entry, contacts.overlap[c], contacts.share[c])
            rate = stiffness * bottles.inverse_mass[i]
            most = rate if rate > most else most
        linear.most[i // UNIT] = most


@part
def linear_rails(world: World, contacts: RailContacts, step: tuple[float, float], first: int, end: int) -> None:
    """Add the forces of rails ahead on bottles first to end to their load, and the resistance to `linear.own`.

    step: as in `linear_contact`.
    """
    bottles, linear, railed = world.bottles, world.linear, world.railed
    if railed is None:
        return
    begin, stop = units(first, end)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        x, y, radius = bottles.x[i], bottles.y[i], bottles.radius[i]
        old_x, old_y = linear.x[i], linear.y[i]
        # First contacts that are closed ahead, then those that were closed before the step, of surfaces not touched
        # ahead.
        for earlier in range(2 if step[1] > 0.5 else 1):
            if earlier:
                bottles.x[i], bottles.y[i] = old_x, old_y
            count = find_rail_contacts(i, world, contacts)
            bottles.x[i], bottles.y[i] = x, y
            for c in range(count):
                overlap = contacts.overlap[c]
                if earlier:
                    away = contacts.nx[c] * (x - old_x) + contacts.ny[c] * (y - old_y)
                    before, ahead = overlap, min(overlap + away, 0.0)
                else:
                    before = _overlap(world, contacts.entry[c], old_x, old_y, radius)
                    ahead = overlap
                handled = earlier and _touches(world, contacts.surface[c], i, x, y, radius)
                if contacts.share[c] > 0.0 and not handled:
                    _add_contact(world, contacts, c, i, (before, ahead), step, earlier > 0)


@part
def _overlap(world: World, entry: int, x: float, y: float, radius: float) -> float:
    """Return the overlap (m) of a circle with the piece at an entry of the lists (`RailContacts.entry`)."""
    if entry >= 0:
        return _segment_overlap(world.segments, world.near_segments, entry, x, y, radius)
    return _arc_overlap(world.arcs, world.near_arcs, -1 - entry, x, y, radius)


@part
def _segment_overlap(segments: Any, near: Any, entry: int, x: float, y: float, radius: float) -> float:
    if segments is None:
        return 0.0
    overlap, _, _ = segment_contact(segments, near.piece[entry], x, y, radius)
    return overlap


@part
def _arc_overlap(arcs: Any, near: Any, entry: int, x: float, y: float, radius: float) -> float:
    if arcs is None:
        return 0.0
    overlap, _, _ = arc_contact(arcs, near.piece[entry], x, y, radius)
    return overlap


@part
def _touches(world: World, surface: int, i: int, x: float, y: float, radius: float) -> bool:
    """Return True if bottle i at (x, y) touches a rail surface."""
    segments, near_segments, arcs, near_arcs = world.segments, world.near_segments, world.arcs, world.near_arcs
    touched = False
    if segments is not None:
        for entry in range(near_segments.start[i], near_segments.start[i + 1]):
            if segments.surface[near_segments.piece[entry]] == surface:
                touched = touched or _segment_overlap(segments, near_segments, entry, x, y, radius) > 0.0
    if arcs is not None:
        for entry in range(near_arcs.start[i], near_arcs.start[i + 1]):
            if arcs.surface[near_arcs.piece[entry]] == surface:
                touched = touched or _arc_overlap(arcs, near_arcs, entry, x, y, radius) > 0.0
    return touched


@part
def _add_contact(
    world: World,
    contacts: RailContacts,
    c: int,
    i: int,
    overlaps: tuple[float, float],
    step: tuple[float, float],
    hold: bool,
) -> None:
    """Add one contact. overlaps, step, hold: as in `linear_contact`."""
    bottles, spin, load, linear = world.bottles, world.spin, world.load, world.linear
    nx, ny = contacts.nx[c], contacts.ny[c]
    closing, slip = bottles.vx[i] * nx + bottles.vy[i] * ny, bottles.vy[i] * nx - bottles.vx[i] * ny
    closing_change = linear.change.x[i] * nx + linear.change.y[i] * ny
    mobility = rim_mobility = bottles.inverse_mass[i]
    arm = 0.0
    if spin is not None:
        arm = rail_arm(overlaps[1], bottles.radius[i], world.settings.lever)
        slip += spin.omega[i] * arm
        rim_mobility += arm * arm * spin.inverse_inertia[i]
    normal, tangential, along, across, normal_before = linear_contact(
        world,
        world.rail_law,
        law_entry(world, contacts, c, i),
        overlaps,
        contacts.share[c],
        (closing, closing + step[1] * closing_change),
        slip,
        (mobility, rim_mobility),
        step,
        hold,
    )
    # The assembled block, which contains this contact, subtracts this term again.
    normal -= along * closing_change / step[0]
    load.fx[i] += -normal * nx - tangential * ny
    load.fy[i] += tangential * nx - normal * ny
    if spin is not None:
        spin.moment[i] += arm * tangential
    _note_normal(load.normal_sum, load.normal_max, i, normal_before)
    add_block(linear.own, i, along, across, nx, ny, arm)


@part
def _note_normal(sums: Any, largest: Any, i: int, normal: float) -> None:
    if sums is not None:
        sums[i] += normal
        largest[i] = normal if normal > largest[i] else largest[i]

# SPDX-License-Identifier: Apache-2.0
"""Contact of bottles with rails: straight pieces and arcs, from lists made at each rebuild."""

from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.contact import carried, contact_parts, history_after, spring_after, stretched
from conveyor_sim.engine.contact.path import displacement_in_touch, slip_time_of
from conveyor_sim.engine.observers.ledger_parts import add_rail_parts
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.deepest_contacts import keep_deepest, law_entry, rail_arm
from conveyor_sim.engine.rails.moving import (
    add_rail_push,
    clear_rail_power,
    clear_rail_push,
    moves,
    moving_contacts,
    moving_spring,
    reset_moving_springs,
    set_moving_spring,
    surface_path,
    surface_velocity,
)
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.rails.shares import share_overlaps
from conveyor_sim.engine.threads.workers import units


@part
def _segment_contacts(i: int, bottles: Bottles, segments: Any, near: Any, contacts: RailContacts, count: int) -> int:
    if segments is None:
        return count
    for entry in range(near.start[i], near.start[i + 1]):
        g = near.piece[entry]
        overlap, nx, ny = segment_contact(segments, g, bottles.x[i], bottles.y[i], bottles.radius[i])
        if overlap > 0.0:
            material, rail, surface = segments.material[g], segments.rail[g], segments.surface[g]
            count = keep_deepest(contacts, count, overlap, nx, ny, material, rail, surface, entry)
    return count


@part
def _arc_contacts(i: int, bottles: Bottles, arcs: Any, near: Any, contacts: RailContacts, count: int) -> int:
    if arcs is None:
        return count
    for entry in range(near.start[i], near.start[i + 1]):
        k = near.piece[entry]
        overlap, nx, ny = arc_contact(arcs, k, bottles.x[i], bottles.y[i], bottles.radius[i])
        if overlap > 0.0:
            material, rail, surface = arcs.material[k], arcs.rail[k], arcs.surface[k]
            count = keep_deepest(contacts, count, overlap, nx, ny, material, rail, surface, -1 - entry)
    return count


@part
def find_rail_contacts(i: int, world: World, contacts: RailContacts) -> int:
    """Write the contacts of bottle i with rails, shares included; return their number."""
    count = _segment_contacts(i, world.bottles, world.segments, world.near_segments, contacts, 0)
    count = _arc_contacts(i, world.bottles, world.arcs, world.near_arcs, contacts, count)
    count = moving_contacts(i, world.bottles, world.moving, world.near_bodies, 0.0, contacts, count)
    if count == 1:
        contacts.share[0] = 1.0
    elif count > 1:
        share_overlaps(contacts, count)
    return count


@part
def rail_contact(
    c: int, i: int, world: World, contacts: RailContacts, spring: Any, spring_dt: float, implicit: Any, held: Any
) -> tuple[float, float, float, Any, float]:
    """Return N and T (N) on bottle i in its contact c with a rail, its slip (m/s), and its spring before that slip.

    The last number is the part of T that is friction by the curve, N.
    spring: m, or None, to be elongated by spring_dt (s) of slip. implicit: `World.implicit`, or None for explicit
    friction. held: friction of the last evaluation, N, if implicit friction starts from it.
    """
    bottles, spin, settings, law = world.bottles, world.spin, world.settings, world.rail_law
    nx, ny = contacts.nx[c], contacts.ny[c]
    ux, uy = surface_velocity(world.moving, contacts, c, bottles, i)
    vx, vy = bottles.vx[i] - ux, bottles.vy[i] - uy
    closing = vx * nx + vy * ny
    slip = -vx * ny + vy * nx
    if spin is not None:
        slip += spin.omega[i] * rail_arm(contacts.overlap[c], bottles.radius[i], settings.lever)
    entry = law_entry(world, contacts, c, i)
    kept = carried(law, entry, spring, contacts.overlap[c], closing * spring_dt, slip * spring_dt)
    normal, tangential, friction = contact_parts(
        law,
        entry,
        world.curves,
        settings.slip_limit,
        settings.atan,
        contacts.overlap[c],
        contacts.share[c],
        closing,
        slip,
        stretched(kept, slip, spring_dt),
        _compliance(world, implicit, contacts, c, i, slip, held),
    )
    return normal, tangential, slip, kept, friction


@part
def count_rail_contacts(world: World, contacts: RailContacts, first: int, end: int, counts: Any) -> None:
    """Add to counts[i] the closed rail contacts of bottles first to end; for the implicit solver."""
    railed = world.railed
    if railed is None:
        return
    begin, stop = units(first, end)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        counts[i] += find_rail_contacts(i, world, contacts)


@part
def add_rail_forces(world: World, contacts: RailContacts, first: int, end: int, spring_dt: float) -> None:
    """Add the forces and moments of all rails on bottles first to end to `load` and `spin.moment`.

    spring_dt: s, time by which the tangential springs are advanced (`pair_phase`).
    """
    railed = world.railed
    if railed is None:
        return
    bottles, spin, load = world.bottles, world.spin, world.load
    clear_rail_power(world.ledger, world.moving, first, end)
    clear_rail_push(world.moving, first, end)
    begin, stop = units(first, end)
    slip_time = slip_time_of(world.path, spring_dt)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        count = find_rail_contacts(i, world, contacts)
        for c in range(count):
            contacts.solution[c] = 0.0
            if contacts.share[c] > 0.0:
                held = rail_elongation(world, i, contacts.entry[c])
                spring = _drawn_out(world, contacts, c, i, held)
                normal, tangential, slip, spring, friction = rail_contact(
                    c, i, world, contacts, spring, slip_time, world.implicit, held
                )
                load.fx[i] += -normal * contacts.nx[c] - tangential * contacts.ny[c]
                load.fy[i] += -normal * contacts.ny[c] + tangential * contacts.nx[c]
                add_rail_push(world.moving, contacts, c, bottles, i, normal, tangential)
                _note_normal(load.normal_sum, load.normal_max, i, normal)
                add_rail_parts(world, contacts, c, i, normal, tangential, slip)
                if spin is not None:
                    spin.moment[i] += (
                        rail_arm(contacts.overlap[c], bottles.radius[i], world.settings.lever) * tangential
                    )
                entry = law_entry(world, contacts, c, i)
                contacts.solution[c] = _history_after(
                    world, entry, spring, held, contacts, c, slip, slip_time, spring_dt, normal, friction
                )
        if _stores(world, spring_dt):
            _store_springs(world, contacts, count, i)


@part
def _drawn_out(world: World, contacts: RailContacts, c: int, i: int, spring: Any) -> Any:
    """Return the elongation (m) of a spring after the displacement since its last update, or None."""
    path = world.path
    if spring is None:
        return None
    if path is None:
        return spring
    bottles = world.bottles
    nx, ny = contacts.nx[c], contacts.ny[c]
    ux, uy = surface_path(world.moving, contacts, c, bottles, i)
    x, y = path.x[i] - ux, path.y[i] - uy
    approach = x * nx + y * ny
    displacement = y * nx - x * ny
    if world.spin is not None:
        displacement += path.turn[i] * rail_arm(
            contacts.overlap[c] - 0.5 * approach, bottles.radius[i], world.settings.lever
        )
    further = displacement_in_touch(displacement, approach, contacts.overlap[c])
    return (
        carried(world.rail_law, law_entry(world, contacts, c, i), spring, contacts.overlap[c], approach, further)
        + further
    )


@part
def _history_after(
    world: World,
    entry: int,
    spring: Any,
    held: Any,
    contacts: RailContacts,
    c: int,
    slip: float,
    dt: float,
    spring_dt: float,
    normal: float,
    friction: float,
) -> float:
    """Return the new history of contact c: elongation (m) or friction (N), see `PairSprings.elongation`."""
    law, overlap, share = world.rail_law, contacts.overlap[c], contacts.share[c]
    if spring is None:
        return 0.0
    if world.settings.warm is not None:
        return history_after(law, entry, spring, held, overlap, slip, dt, spring_dt, normal, share, friction)
    return spring_after(law, entry, spring, overlap, slip, dt, normal, share)


@part
def _stores(world: World, spring_dt: float) -> bool:
    """Return True if an evaluation stores the history of contacts: for warm starts, every one does."""
    if world.settings.warm is not None:
        return True
    return spring_dt > 0.0


@part
def _note_normal(sums: Any, largest: Any, i: int, normal: float) -> None:
    if sums is not None:
        sums[i] += normal
        largest[i] = normal if normal > largest[i] else largest[i]


@part
def _compliance(world: World, implicit: Any, contacts: RailContacts, c: int, i: int, slip: float, held: Any) -> Any:
    if implicit is None:
        return None
    return implicit.compliance[i], world.settings.at_once, _first_slip(world, implicit, contacts, c, i, slip, held)


@part
def _first_slip(world: World, implicit: Any, contacts: RailContacts, c: int, i: int, slip: float, held: Any) -> float:
    """Return the slip (m/s) from which the implicit solver starts, without the friction of the last evaluation."""
    if world.settings.warm is None:
        return slip
    return slip + _slip_of_kick(world, implicit.kick, contacts, c, i) - implicit.compliance[i] * held


@part
def _slip_of_kick(world: World, kick: Any, contacts: RailContacts, c: int, i: int) -> float:
    if kick is None:
        return 0.0
    along = kick.y[i] * contacts.nx[c] - kick.x[i] * contacts.ny[c]
    if world.spin is not None:
        along += kick.turn[i] * rail_arm(contacts.overlap[c], world.bottles.radius[i], world.settings.lever)
    return along


@part
def rail_elongation(world: World, i: int, entry: int) -> Any:
    """Return the history of a contact of bottle i (`PairSprings.elongation`) by its entry, or None."""
    if world.rail_law.tangential_stiffness is None:
        return _friction_before(world, i, entry)
    return _history(world, i, entry)


@part
def _friction_before(world: World, i: int, entry: int) -> Any:
    if world.settings.warm is None:
        return None
    return _history(world, i, entry)


@part
def _history(world: World, i: int, entry: int) -> float:
    if moves(world.moving, entry):
        return moving_spring(world.moving, i, entry)
    if entry >= 0:
        return _spring_at(world.near_segments, entry)
    return _spring_at(world.near_arcs, -1 - entry)


@part
def _spring_at(near: Any, entry: int) -> float:
    if near is None:
        return 0.0
    return near.springs.elongation[entry]


@part
def _store_springs(world: World, contacts: RailContacts, count: int, i: int) -> None:
    """Store the springs of the closed contacts of bottle i; reset those of all its other rails."""
    if world.rail_law.tangential_stiffness is None:
        if world.settings.warm is None:
            return
    _reset_springs(world.near_segments, i)
    _reset_springs(world.near_arcs, i)
    reset_moving_springs(world.moving, world.near_bodies, i)
    for c in range(count):
        if moves(world.moving, contacts.entry[c]):
            set_moving_spring(world.moving, i, contacts.entry[c], contacts.solution[c])
        elif contacts.entry[c] >= 0:
            _set_spring(world.near_segments, contacts.entry[c], contacts.solution[c])
        else:
            _set_spring(world.near_arcs, -1 - contacts.entry[c], contacts.solution[c])


@part
def _reset_springs(near: Any, i: int) -> None:
    if near is not None:
        for entry in range(near.start[i], near.start[i + 1]):
            near.springs.elongation[entry] = 0.0


@part
def _set_spring(near: Any, entry: int, elongation: float) -> None:
    if near is not None:
        near.springs.elongation[entry] = elongation

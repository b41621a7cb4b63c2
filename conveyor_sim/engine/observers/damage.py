# SPDX-License-Identifier: Apache-2.0
"""Loads on bottles and rails in every step: scuffing, crushing, impacts, tipping. It changes no force.

The state is evaluated between two steps. Each bottle lists its closed contacts, with the forces of the laws there, and
adds up its own; both partners add up a contact that they share. So no bottle writes data of another one, no sum runs
over bottles of several threads, and the evaluation is the same for every integrator. Nothing is recorded within a step.

Keys of contacts: id + 1 of the other bottle; -1 - 2 g for segment g; -2 - 2 k for arc k; less than -MOVING for a moving
rail.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums, Spin
from conveyor_sim.engine.arrays.damage import MOST_BORNE, MOST_TOUCHES, ContactLoads, Maximum, RailBins
from conveyor_sim.engine.arrays.rails import Arcs, Segments
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.pairs import normal_and_overlap
from conveyor_sim.engine.contact.slots import WIDTH
from conveyor_sim.engine.observers.contact_list import pair_contact
from conveyor_sim.engine.rails.moving import MOVING, moves, seen_from, surface_velocity
from conveyor_sim.engine.rails.rails import find_rail_contacts, rail_contact, rail_elongation
from conveyor_sim.engine.support.base import add_base_friction, add_straddling_friction
from conveyor_sim.engine.support.footing import check_footing
from conveyor_sim.engine.support.static_friction import add_static_friction
from conveyor_sim.engine.threads.workers import BLOCK, UNIT, share, wait_for_all


@part
def note_damage(world: World, worker: Worker, dt: float) -> None:
    """Evaluate the loads on all bottles in the present state, for a step of dt seconds.

    Lists must hold and bottles must be in place. Every worker calls it; on return all have read what they need.
    """
    _note(world, world.damage, worker, dt)


@part
def _note(world: World, damage: Any, worker: Worker, dt: float) -> None:
    if damage is None:
        return
    # Velocity Verlet has just set velocities, each worker for its share of the bottles.
    wait_for_all(worker)
    begin, stop = share(worker, world.bottles.x.size)
    for first in range(begin, stop, BLOCK):
        end = min(first + BLOCK, stop)
        _find_base(world, damage.tipping, dt, first, end)
        for i in range(first, end):
            if world.bottles.id[i] >= 0:
                count = _list_pairs(i, world, damage.impacts, worker.history)
                count = _list_rails(i, world, damage, worker, count)
                _scuff(i, damage.scuffing, worker.history, count, dt)
                _crush(i, damage.crushing, worker.history, count)
                _hit(i, damage.impacts, worker.history, count)
                _tip(i, world.bottles, damage.tipping, worker.history, count, dt)
    wait_for_all(worker)
    _store_velocities(world.bottles, damage.impacts, begin, stop)


@part
def _list_pairs(i: int, world: World, impacts: Any, history: ContactLoads) -> int:
    """Write the closed contacts of bottle i with others to `history`; return their number."""
    slots = world.slots
    if world.pairs is None:
        return 0
    count = 0
    for place in range(int(slots.filled[i])):
        # One loop, because two call sites would compile the law twice.
        further = int(slots.more_start[i]) + place - WIDTH
        entry = slots.entry[i * WIDTH + place] if place < WIDTH else slots.more_entry[further]
        count = _list_pair(i, int(entry), world, impacts, history, count)
    return count


@part
def _list_pair(i: int, entry: int, world: World, impacts: Any, history: ContactLoads, count: int) -> int:
    bottles, pairs = world.bottles, world.pairs
    p = entry if entry < pairs.i.size else entry - pairs.i.size
    j = int(pairs.j[p]) if entry < pairs.i.size else int(pairs.i[p])
    reach = bottles.radius[i] + bottles.radius[j]
    dx, dy = bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i]
    if dx * dx + dy * dy >= reach * reach or count == MOST_BORNE:
        return count
    overlap, nx, ny = normal_and_overlap(dx, dy, reach)
    # The law is that of i and j in the order of the pair.
    sign = 1.0 if entry < pairs.i.size else -1.0
    normal, tangential, slip = pair_contact(world, p, overlap, sign * nx, sign * ny)
    approach = _approach(impacts, i, nx, ny) - _approach(impacts, j, nx, ny)
    _write_force(history, count, nx, ny, normal, tangential, slip)
    _write_place(history, count, approach, bottles.id[j] + 1, -1)
    return count + 1


@part
def _list_rails(i: int, world: World, damage: Any, worker: Worker, count: int) -> int:
    if world.rail_law is None:
        return count
    bottles, contacts = world.bottles, worker.rail_contacts
    for c in range(find_rail_contacts(i, world, contacts)):
        # A contact with share 0 exerts no force: another piece of the same surface carries its load and counts.
        if contacts.share[c] > 0.0 and count < MOST_BORNE:
            entry = contacts.entry[c]
            spring = rail_elongation(world, i, entry)
            normal, tangential, slip, _, _ = rail_contact(c, i, world, contacts, spring, 0.0, None, None)
            nx, ny = contacts.nx[c], contacts.ny[c]
            arm = bottles.radius[i] - contacts.overlap[c]
            x, y = bottles.x[i] + arm * nx, bottles.y[i] + arm * ny
            if moves(world.moving, entry):
                key, place = -entry, body_bin(damage.scuffing, world.moving, entry - MOVING, x, y)
            else:
                key = _rail_key(world.near_segments, world.near_arcs, entry)
                place = rail_bin(damage.scuffing, world.segments, world.arcs, key, x, y)
            ux, uy = surface_velocity(world.moving, contacts, c, bottles, i)
            approach = _approach(damage.impacts, i, nx, ny) - (ux * nx + uy * ny)
            _write_force(worker.history, count, nx, ny, normal, tangential, slip)
            _write_place(worker.history, count, approach, key, place)
            count += 1
    return count


@part
def _write_force(
    history: ContactLoads, c: int, nx: float, ny: float, normal: float, tangential: float, slip: float
) -> None:
    history.nx[c] = nx
    history.ny[c] = ny
    # Paper damping may pull at the end of a rebound.
    history.normal[c] = normal if normal > 0.0 else 0.0
    history.tangential[c] = tangential
    history.slip[c] = slip


@part
def _write_place(history: ContactLoads, c: int, approach: float, key: int, place: int) -> None:
    history.approach[c] = approach
    history.key[c] = key
    history.place[c] = place


@part
def _approach(impacts: Any, i: int, nx: float, ny: float) -> float:
    """Return the speed of bottle i along a normal at the last evaluation, m/s."""
    if impacts is None:
        return 0.0
    return impacts.vx[i] * nx + impacts.vy[i] * ny


@part
def _rail_key(near_segments: Any, near_arcs: Any, entry: int) -> int:
    if entry >= 0:
        return -1 - 2 * _piece(near_segments, entry)
    return -2 - 2 * _piece(near_arcs, -1 - entry)


@part
def _piece(near: Any, entry: int) -> int:
    if near is None:
        return 0
    return int(near.piece[entry])


@part
def rail_bin(scuffing: Any, segments: Any, arcs: Any, key: int, x: float, y: float) -> int:
    """Return the bin of a rail piece, by its key, at a point (m); -1 without the effect `scuffing`."""
    if scuffing is None:
        return -1
    if key % 2 != 0:
        return _segment_bin(scuffing.bins, segments, (-1 - key) // 2, x, y)
    return _arc_bin(scuffing.bins, arcs, (-2 - key) // 2, x, y)


@part
def _segment_bin(bins: RailBins, segments: Any, g: int, x: float, y: float) -> int:
    if segments is None:
        return -1
    return _bin_at(int(bins.segment_first[g]), int(bins.segment_first[g + 1]), _along_segment(segments, g, x, y))


@part
def _along_segment(segments: Segments, g: int, x: float, y: float) -> float:
    """Return the place of a point (m) along a segment, as a share of its length."""
    along = (x - segments.x[g]) * segments.tx[g] + (y - segments.y[g]) * segments.ty[g]
    return along / segments.length[g]


@part
def _arc_bin(bins: RailBins, arcs: Any, k: int, x: float, y: float) -> int:
    if arcs is None:
        return -1
    return _bin_at(int(bins.arc_first[k]), int(bins.arc_first[k + 1]), _along_arc(arcs, k, bins.arc_span[k], x, y))


@part
def _along_arc(arcs: Arcs, k: int, span: float, x: float, y: float) -> float:
    """Return the place of a point (m) along an arc, as a share of its span (rad)."""
    dx, dy = x - arcs.x[k], y - arcs.y[k]
    start_x, start_y = arcs.start_x[k], arcs.start_y[k]
    angle = math.atan2(start_x * dy - start_y * dx, start_x * dx + start_y * dy)
    # The range of angles starts at half the gap before the start.
    if angle < 0.5 * span - math.pi:
        angle += 2.0 * math.pi
    return angle / span


@part
def body_bin(scuffing: Any, moving: Any, q: int, x: float, y: float) -> int:
    """Return the bin of piece q of a body at a point (m) of its present place; -1 if bins are not requested."""
    if scuffing is None:
        return -1
    return _bin_of_piece(scuffing.bins.bodies, moving, q, x, y)


@part
def _bin_of_piece(bins: Any, moving: Any, q: int, x: float, y: float) -> int:
    if bins is None:
        return -1
    first, end = int(bins.first[q]), int(bins.end[q])
    straight = _count(moving.segments)
    if q < straight:
        return _bin_at(first, end, _along_body_segment(moving.segments, q, x, y))
    across, ahead = seen_from(moving, moving.body[q], x, y)
    return _bin_at(first, end, _along_body_arc(moving.arcs, q - straight, bins.span[q], across, ahead))


@part
def _count(segments: Any) -> int:
    if segments is None:
        return 0
    return segments.x.size


@part
def _along_body_segment(segments: Any, g: int, x: float, y: float) -> float:
    if segments is None:
        return 0.0
    return _along_segment(segments, g, x, y)


@part
def _along_body_arc(arcs: Any, k: int, span: float, x: float, y: float) -> float:
    if arcs is None:
        return 0.0
    return _along_arc(arcs, k, span, x, y)


@part
def _bin_at(first: int, end: int, position: float) -> int:
    """Return which of the bins first to end lies at a share of the length along them."""
    return first + min(max(math.floor(position * (end - first)), 0), end - first - 1)


@part
def _scuff(i: int, scuffing: Any, history: ContactLoads, count: int, dt: float) -> None:
    """Add |T s| dt to the bottle, and to the rail on which it slides."""
    if scuffing is None:
        return
    for c in range(count):
        work = dt * abs(history.tangential[c] * history.slip[c])
        scuffing.work[i] += work
        wear(scuffing.bins, i // UNIT, history.place[c], work, dt * history.normal[c])


@part
def wear(bins: Any, unit: int, place: int, work: float, impulse: float) -> None:
    """Add sliding work (J) and normal impulse (N s) to a bin of a rail; place -1: none."""
    if bins is None:
        return
    if place >= 0:
        bins.work[unit, place] += work
        bins.impulse[unit, place] += impulse


@part
def _crush(i: int, crushing: Any, history: ContactLoads, count: int) -> None:
    """Update the sum of normal forces, and the largest min(N_a, N_b) |cos| of two opposing ones."""
    if crushing is None:
        return
    total = opposed = 0.0
    for a in range(count):
        total += history.normal[a]
        for b in range(a):
            cosine = history.nx[a] * history.nx[b] + history.ny[a] * history.ny[b]
            opposed = max(opposed, -cosine * min(history.normal[a], history.normal[b]))
    raise_to(crushing.total, i, total)
    raise_to(crushing.opposed, i, opposed)


@part
def _hit(i: int, impacts: Any, history: ContactLoads, count: int) -> None:
    """Update the largest force of one contact, and the closing speed of contacts that were open before."""
    if impacts is None:
        return
    before = 0
    while before < MOST_TOUCHES and impacts.touching[i, before] != 0:
        impacts.touched[i, before] = impacts.touching[i, before]
        before += 1
    for c in range(count):
        raise_to(impacts.force, i, history.normal[c])
        known = before == MOST_TOUCHES
        for place in range(before):
            known = known or impacts.touched[i, place] == history.key[c]
        if not known:
            raise_to(impacts.speed, i, history.approach[c])
        if c < MOST_TOUCHES:
            impacts.touching[i, c] = history.key[c]
    if count < MOST_TOUCHES:
        impacts.touching[i, count] = 0


@part
def raise_to(worst: Maximum, i: int, value: float) -> None:
    """Raise the maximum of bottle i in the present tick to a value."""
    if value > worst.tick[i]:
        worst.tick[i] = value


@part
def _store_velocities(bottles: Bottles, impacts: Any, begin: int, stop: int) -> None:
    if impacts is None:
        return
    for i in range(begin, stop):
        impacts.vx[i] = bottles.vx[i]
        impacts.vy[i] = bottles.vy[i]


@part
def _find_base(world: World, tipping: Any, dt: float, first: int, end: int) -> None:
    """Compute the friction under bottles first to end, N."""
    if tipping is None:
        return
    for i in range(first, end):
        tipping.fx[i] = tipping.fy[i] = tipping.moment[i] = 0.0
    load = ForceSums(tipping.fx, tipping.fy, None, None)
    check_footing(world.bottles, world.belts, world.surface, world.footing, world.ring, first, end)
    spin, lag = _apart(world.spin, tipping.moment), world.settings.lag * dt
    add_base_friction(world, spin, load, None, dt, dt, first, end)
    add_straddling_friction(world, spin, load, None, lag, first, end)
    add_static_friction(world.bottles, load, world.footing, world.static_friction, lag, False, first, end)


@part
def _apart(spin: Any, moment: Any) -> Any:
    """Return the spins with another array for moments."""
    if spin is None:
        return None
    return Spin(spin.theta, spin.omega, spin.inverse_inertia, moment)


@part
def _tip(i: int, bottles: Bottles, tipping: Any, history: ContactLoads, count: int, dt: float) -> None:
    if tipping is None:
        return
    fx = fy = 0.0
    for c in range(count):
        fx -= history.normal[c] * history.nx[c] + history.tangential[c] * history.ny[c]
        fy += history.tangential[c] * history.nx[c] - history.normal[c] * history.ny[c]
    tip(i, bottles, tipping, fx, fy, dt)


@part
def tip(i: int, bottles: Bottles, tipping: Any, fx: float, fy: float, dt: float) -> None:
    """Update |F_c (h_c - h_cg) - F_b h_cg| / (m g R_b), smoothed because a blow is over before a bottle can tip.

    fx, fy: sum of the contact forces on bottle i, N.
    """
    if bottles.weight[i] <= 0.0:
        return
    kind = bottles.type[i]
    along, under = tipping.contact_lever[kind] / bottles.weight[i], tipping.base_lever[kind] / bottles.weight[i]
    weight = dt / (dt + tipping.delay[kind])
    tipping.mean_x[i] += weight * (along * fx - under * tipping.fx[i] - tipping.mean_x[i])
    tipping.mean_y[i] += weight * (along * fy - under * tipping.fy[i] - tipping.mean_y[i])
    raise_to(tipping.ratio, i, math.sqrt(tipping.mean_x[i] ** 2 + tipping.mean_y[i] ** 2))

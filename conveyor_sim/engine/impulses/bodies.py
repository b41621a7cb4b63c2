# SPDX-License-Identifier: Apache-2.0
"""A sweep over the contacts of bottles with bodies under axes, bottle by bottle.

At the beginning of a substep each bottle finds its contacts: normal, gap and velocity of the surface, in the middle of
the coming motion of the body. They hold for all sweeps. An impulse belongs to a bottle and a piece; it is released when
the piece is out of reach or its body absent.

A body on its profile has infinite mass. If the peak force of an impact would exceed the limit of
its drive, the impact waits for the axis to leave its profile. The contacts of axes off their profiles are visited one
by one (`drives.py`).
"""

from typing import Any

from conveyor_sim.engine.arrays.impulses import (
    ACROSS,
    AHEAD,
    ASIDE,
    BODY,
    CONSTANTS,
    CONTACTS,
    GAP,
    GEOMETRY,
    NORMAL,
    NX,
    NY,
    ROW,
    BodyImpulses,
)
from conveyor_sim.engine.arrays.moving import HELD, MovingBodies
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.impulses.constants import (
    APART,
    CLOSED,
    COMPLIANCE,
    FASTEST,
    FRICTION,
    GAIN_CLOSED,
    GAIN_OPEN,
    MASS,
    OPEN,
    PEAK,
    REBOUND,
    TURN,
)
from conveyor_sim.engine.impulses.law import visit
from conveyor_sim.engine.impulses.loads import note_blow, note_pressed
from conveyor_sim.engine.impulses.pairs import note_peak
from conveyor_sim.engine.impulses.work import book_body, book_impact, note_impact
from conveyor_sim.engine.observers.damage import body_bin, wear
from conveyor_sim.engine.rails.actuators import is_off_profile
from conveyor_sim.engine.rails.moving import MOVING, belt_speed, clear_rail_push, mean_motion, moving_contacts
from conveyor_sim.engine.rails.poses import mean_speed
from conveyor_sim.engine.threads.workers import UNIT, units

MARKED, LEFT = 1, 2
"""Marks of axes that leave their profiles in a substep: still to be done, and done."""


@part
def find_bodies(world: World, worker: Worker, impulses: Any, bodies: Any, h: float, first: int, end: int) -> None:
    """Find the contacts of bottles first to end with bodies for a substep of h (s); release impulses of others."""
    if bodies is None:
        return
    clear_rail_push(world.moving, first, end)
    _clear_struck(world.moving, bodies, first, end)
    near, piece = world.near_bodies, bodies.piece
    for i in range(first, end):
        c = CONTACTS * i
        # -1 in all bits: no piece.
        if near.start[i] < near.start[i + 1] or piece[c] & piece[c + 1] & piece[c + 2] & piece[c + 3] != -1:
            _find(i, world, world.moving, near, worker.rail_contacts, impulses, bodies, h)


@part
def _clear_struck(moving: MovingBodies, bodies: BodyImpulses, first: int, end: int) -> None:
    begin, stop = units(first, end)
    axes = moving.position.size
    for entry in range(begin * axes, stop * axes):
        bodies.struck[entry] = 0.0


@part
def _find(
    i: int,
    world: World,
    moving: MovingBodies,
    near: Any,
    contacts: RailContacts,
    impulses: Any,
    bodies: BodyImpulses,
    h: float,
) -> None:
    margin, first = 0.5 * world.settings.skin, CONTACTS * i
    count = _deepest(contacts, moving_contacts(i, world.bottles, moving, near, margin, contacts, 0))
    for place in range(first, first + CONTACTS):
        if bodies.piece[place] >= 0 and not _touches(contacts, count, bodies.piece[place]):
            _release(impulses.body, bodies, i, place)
    for c in range(count):
        q = contacts.entry[c] - MOVING
        place = _place_of(bodies, first, q)
        bodies.piece[place] = q
        bodies.kind[place] = CONSTANTS * (world.bottles.type[i] * world.settings.rail_materials + contacts.material[c])
        _describe(i, world, moving, contacts, c, margin - contacts.overlap[c], bodies, place, h)


@part
def _deepest(contacts: RailContacts, count: int) -> int:
    """Drop the shallowest of more than CONTACTS contacts; return the number of those left."""
    while count > CONTACTS:
        shallowest = 0
        for c in range(1, count):
            if contacts.overlap[c] < contacts.overlap[shallowest]:
                shallowest = c
        count -= 1
        contacts.overlap[shallowest] = contacts.overlap[count]
        contacts.nx[shallowest] = contacts.nx[count]
        contacts.ny[shallowest] = contacts.ny[count]
        contacts.material[shallowest] = contacts.material[count]
        contacts.entry[shallowest] = contacts.entry[count]
    return count


@part
def _touches(contacts: RailContacts, count: int, q: int) -> bool:
    touches = False
    for c in range(count):
        touches = touches or contacts.entry[c] - MOVING == q
    return touches


@part
def _release(body: Any, bodies: BodyImpulses, i: int, place: int) -> None:
    b, row = BODY * i, ROW * place
    body[b + 2] += body[b + 5] * bodies.row[row]
    body[b + 3] += body[b + 5] * bodies.row[row + 1]
    body[b + 4] -= body[b + 6] * bodies.row[row + 2]
    bodies.piece[place] = -1
    for number in range(ROW):
        bodies.row[row + number] = 0.0


@part
def _place_of(bodies: BodyImpulses, first: int, q: int) -> int:
    """Return the place of piece q, or the first free one."""
    free = -1
    for place in range(first, first + CONTACTS):
        if bodies.piece[place] == q:
            return place
        if bodies.piece[place] < 0 and free < 0:
            free = place
    return free


@part
def _describe(
    i: int,
    world: World,
    moving: MovingBodies,
    contacts: RailContacts,
    c: int,
    gap: float,
    bodies: BodyImpulses,
    place: int,
    h: float,
) -> None:
    bottles, row, b = world.bottles, GEOMETRY * place, moving.body[bodies.piece[place]]
    nx, ny, a, speed = contacts.nx[c], contacts.ny[c], moving.axis[b], 0.0
    ahead = aside = 0.0
    if a >= 0:
        arm = bottles.radius[i] + gap
        dx, dy = bottles.x[i] + arm * nx - moving.pose.x[b], bottles.y[i] + arm * ny - moving.pose.y[b]
        ahead, aside = mean_motion(moving, contacts, c, dx, dy, h)
        speed = mean_speed(moving, a, h)
    bodies.axis[place] = a
    bodies.geometry[row + NX] = nx
    bodies.geometry[row + NY] = ny
    bodies.geometry[row + GAP] = gap
    bodies.geometry[row + NORMAL] = speed * ahead
    bodies.geometry[row + ACROSS] = speed * aside + belt_speed(moving, contacts, c, bottles, i)
    bodies.geometry[row + AHEAD] = ahead
    bodies.geometry[row + ASIDE] = aside


@part
def sweep_bodies(world: World, impulses: Any, bodies: Any, h: float, threshold: float, first: int, end: int) -> None:
    """Visit every contact of bottles first to end with bodies once, except those of axes off their profiles."""
    if bodies is None:
        return
    railed = world.railed
    begin, stop = units(first, end)
    for entry in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0 and not _is_off(world.moving, bodies.axis[place]):
                _visit_on_profile(i, place, world, world.moving, impulses, bodies, h, threshold)


@part
def _is_off(moving: MovingBodies, a: int) -> bool:
    if a < 0:
        return False
    return is_off_profile(moving.actuators, a)


@part
def _visit_on_profile(
    i: int,
    place: int,
    world: World,
    moving: MovingBodies,
    impulses: Any,
    bodies: BodyImpulses,
    h: float,
    threshold: float,
) -> None:
    if _overpowers(i, place, world, moving.actuators, impulses, bodies, h, threshold):
        bodies.leaves[bodies.axis[place]] = MARKED
    else:
        visit_body(i, place, world, moving, impulses, bodies, h, threshold, False)


@part
def _overpowers(
    i: int, place: int, world: World, actuators: Any, impulses: Any, bodies: BodyImpulses, h: float, threshold: float
) -> bool:
    """Return True if a contact is an impact whose peak force exceeds the limit of the drive."""
    if actuators is None:
        return False
    a, g, row = bodies.axis[place], GEOMETRY * place, ROW * place
    if a < 0 or bodies.row[row] != 0.0 or bodies.row[row + 1] != 0.0 or bodies.row[row + 3] != 0.0:
        return False
    gap, separating = _gap(i, g, world, impulses, bodies), _separating(i, g, impulses, bodies, 0.0)
    if separating >= -threshold or gap + h * separating > 0.0 or actuators.mode[a] == HELD:
        return False
    peak = -separating * impulses.rail_constants[bodies.kind[place] + PEAK]
    return peak * abs(bodies.geometry[g + AHEAD]) > actuators.limit[a]


@part
def _gap(i: int, g: int, world: World, impulses: Any, bodies: BodyImpulses) -> float:
    body, bottles, geometry, b = impulses.body, world.bottles, bodies.geometry, BODY * i
    x, y = body[b] - bottles.x[i], body[b + 1] - bottles.y[i]
    return geometry[g + GAP] - (x * geometry[g + NX] + y * geometry[g + NY])


@part
def _separating(i: int, g: int, impulses: Any, bodies: BodyImpulses, speed: float) -> float:
    """Return the speed at which a contact opens, m/s. speed: of an axis off its profile."""
    body, geometry, b = impulses.body, bodies.geometry, BODY * i
    along = body[b + 2] * geometry[g + NX] + body[b + 3] * geometry[g + NY]
    return geometry[g + NORMAL] + speed * geometry[g + AHEAD] - along


@part
def visit_body(
    i: int,
    place: int,
    world: World,
    moving: MovingBodies,
    impulses: Any,
    bodies: BodyImpulses,
    h: float,
    threshold: float,
    off: bool,
) -> None:
    """Visit a contact of bottle i. off: its axis is off its profile, so its mass and its speed take part."""
    body, geometry = impulses.body, bodies.geometry
    b, row, g, a = BODY * i, ROW * place, GEOMETRY * place, bodies.axis[place]
    nx, ny, ahead, aside = geometry[g + NX], geometry[g + NY], geometry[g + AHEAD], geometry[g + ASIDE]
    speed = bodies.speed[a] if off else 0.0
    gap, separating = _gap(i, g, world, impulses, bodies), _separating(i, g, impulses, bodies, speed)
    slip = geometry[g + ACROSS] + speed * aside - (body[b + 3] * nx - body[b + 2] * ny) - body[b + 4]
    table, kind = impulses.rail_constants, bodies.kind[place]
    mobility = _mobility(moving.actuators, a) if off else 0.0
    more, across = mobility * ahead * ahead, mobility * aside * aside
    mass, turn = table[kind + MASS] + more, table[kind + TURN] + across
    x, y, spun, new_x, new_y, new_turn, wait, shift_x, shift_y, act, normal, _ = visit(
        bodies.row[row],
        bodies.row[row + 1],
        bodies.row[row + 2],
        bodies.row[row + 3],
        nx,
        ny,
        gap,
        separating,
        slip,
        mass,
        1.0 / mass,
        turn,
        1.0 / turn,
        table[kind + OPEN],
        table[kind + CLOSED],
        table[kind + GAIN_OPEN] / (1.0 + more * table[kind + GAIN_OPEN]),
        table[kind + GAIN_CLOSED] / (1.0 + more * table[kind + GAIN_CLOSED]),
        table[kind + COMPLIANCE],
        table[kind + REBOUND] * (table[kind + MASS] / mass),
        table[kind + FRICTION] * (turn / table[kind + TURN]),
        table[kind + APART],
        table[kind + FASTEST],
        threshold,
        world.settings.slip_limit,
        h,
    )
    bodies.row[row + 3] = wait
    if act == 0.0:
        return
    body[b] -= body[b + 5] * shift_x
    body[b + 1] -= body[b + 5] * shift_y
    body[b + 2] -= body[b + 5] * x
    body[b + 3] -= body[b + 5] * y
    body[b + 4] += body[b + 6] * spun
    bodies.row[row] = new_x
    bodies.row[row + 1] = new_y
    bodies.row[row + 2] = new_turn
    work = (x * nx + y * ny) * ahead + (y * nx - x * ny) * aside
    if off:
        bodies.speed[a] += mobility * work
    if act > 1.0:
        free, f = impulses.free, 4 * i
        free[f] -= body[b + 5] * x
        free[f + 1] -= body[b + 5] * y
        free[f + 2] += body[b + 6] * spun
        mean = 0.5 * (speed + bodies.speed[a]) if off else 0.0
        after = slip + turn * -spun
        peak = -separating * table[kind + PEAK]
        _note_impact(moving.actuators, bodies, i, a, work / h, off)
        _note_peak(world.peaks, i, peak, normal)
        _book(world, impulses.work, body, bodies, i, place, normal, x, y, spun, separating, slip, mass, turn, mean)
        _load_blow(
            world, world.damage, impulses.loads, bodies, i, place, normal, x, y, spun, slip + after, -separating, peak
        )


@part
def _note_peak(peaks: Any, i: int, force: float, normal: float) -> None:
    if peaks is not None:
        note_peak(peaks, i, force, normal)


@part
def _book(
    world: World,
    work: Any,
    body: F8,
    bodies: BodyImpulses,
    i: int,
    place: int,
    normal: float,
    x: float,
    y: float,
    along: float,
    separating: float,
    slip: float,
    mass: float,
    turn: float,
    speed: float,
) -> None:
    """Book an impact of bottle i on a body in the energy ledger. speed: mean, of an axis off its profile."""
    if work is None:
        return
    book_impact(world.ledger, i // UNIT, normal, along, separating, slip, mass, turn)
    note_impact(work, body, i, -1.0, x, y, along)
    book_body(world.ledger, world.moving, bodies, i, place, x, y, speed)


@part
def _load_blow(
    world: World,
    damage: Any,
    loads: Any,
    bodies: BodyImpulses,
    i: int,
    place: int,
    normal: float,
    x: float,
    y: float,
    along: float,
    slips: float,
    closing: float,
    peak: float,
) -> None:
    """Note an impact of bottle i on a body. slips: sum of the slips before and after it, m/s."""
    if loads is None:
        return
    work = abs(0.5 * along * slips)
    note_blow(damage, loads, i, -x, -y, closing, peak, work)
    _wear(world, damage.scuffing, bodies, i, place, work, normal)


@part
def _wear(world: World, scuffing: Any, bodies: BodyImpulses, i: int, place: int, work: float, normal: float) -> None:
    if scuffing is None:
        return
    body, g = world.impulses.body, GEOMETRY * place
    x = body[BODY * i] + body[BODY * i + 7] * bodies.geometry[g + NX]
    y = body[BODY * i + 1] + body[BODY * i + 7] * bodies.geometry[g + NY]
    wear(scuffing.bins, i // UNIT, body_bin(scuffing, world.moving, bodies.piece[place], x, y), work, normal)


@part
def _mobility(actuators: Any, a: int) -> float:
    if actuators is None:
        return 0.0
    return 1.0 / actuators.mass[a]


@part
def _note_impact(actuators: Any, bodies: BodyImpulses, i: int, a: int, force: float, off: bool) -> None:
    """Note the mean force (N or N m) of an impact over a substep. off: the axis recoils from it."""
    if actuators is None:
        return
    if a < 0:
        return
    if off:
        actuators.push[i // UNIT, a, 0] += force
    else:
        bodies.struck[i // UNIT * actuators.mode.size + a] += force


@part
def end_bodies(world: World, impulses: Any, bodies: Any, h: float, first: int, end: int) -> None:
    """Note the pressed contacts of bottles first to end with bodies after the last sweep: on axes, in peaks and loads.

    Forces are held impulses over h (s).
    """
    if bodies is None:
        return
    railed = world.railed
    begin, stop = units(first, end)
    for entry in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[entry]
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0:
                _add_push(world.moving.actuators, bodies, i, place, h)
                _note_pressed(world, world.moving, impulses, bodies, i, place, h)


@part
def _add_push(actuators: Any, bodies: BodyImpulses, i: int, place: int, h: float) -> None:
    if actuators is None:
        return
    if bodies.axis[place] >= 0:
        actuators.push[i // UNIT, bodies.axis[place], 0] += held_work(bodies, place) / h


@part
def _note_pressed(
    world: World, moving: MovingBodies, impulses: Any, bodies: BodyImpulses, i: int, place: int, h: float
) -> None:
    row, g, geometry = ROW * place, GEOMETRY * place, bodies.geometry
    normal = bodies.row[row] * geometry[g + NX] + bodies.row[row + 1] * geometry[g + NY]
    if normal > 0.0:
        _note_peak(world.peaks, i, normal / h, normal)
        _load(world, world.damage, impulses.loads, moving, impulses.body, bodies, i, place, normal, h)


@part
def _load(
    world: World,
    damage: Any,
    loads: Any,
    moving: MovingBodies,
    body: F8,
    bodies: BodyImpulses,
    i: int,
    place: int,
    normal: float,
    h: float,
) -> None:
    """Note a pressed contact of bottle i with a body, as a load on both."""
    if loads is None:
        return
    row, g, b, geometry, a = ROW * place, GEOMETRY * place, BODY * i, bodies.geometry, bodies.axis[place]
    nx, ny = geometry[g + NX], geometry[g + NY]
    speed = bodies.speed[a] if _is_off(moving, a) else 0.0
    slip = geometry[g + ACROSS] + speed * geometry[g + ASIDE] - (body[b + 3] * nx - body[b + 2] * ny) - body[b + 4]
    work = abs(bodies.row[row + 2] * slip)
    note_pressed(damage, loads, i, -1.0, bodies.row[row], bodies.row[row + 1], nx, ny, normal, work, h)
    _wear(world, damage.scuffing, bodies, i, place, work, normal)


@part
def held_work(bodies: BodyImpulses, place: int) -> float:
    """Return the impulse that a contact holds on its axis, N s or N m s."""
    row, g, geometry = ROW * place, GEOMETRY * place, bodies.geometry
    x, y, nx, ny = bodies.row[row], bodies.row[row + 1], geometry[g + NX], geometry[g + NY]
    return (x * nx + y * ny) * geometry[g + AHEAD] + (y * nx - x * ny) * geometry[g + ASIDE]

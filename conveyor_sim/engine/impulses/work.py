# SPDX-License-Identifier: Apache-2.0
"""Accounts of the energy ledger with the method of impulses: the work of impulses, added up in every substep.

An impact is booked at its visit, with the mean of the velocities before and after it, so its normal part is exactly
(1 - e^2)/2 m_r v^2. The friction under a bottle and its pressed contacts act together over the substep. All are booked
with the mean of the velocities at its ends, without the change by impacts, so forces on a bottle at rest do no work
on it. Work of pressed contacts that follows an impact in the same substep is booked as damping. All of this together
is exactly the change of kinetic energy; positions that are corrected change none.

Pairs are booked by units of their colour, rails and base by units of bottles, so sums do not depend on the threads.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.impulses import (
    ACROSS,
    AHEAD,
    ASIDE,
    BODY,
    COLOURS,
    CONTACTS,
    GEOMETRY,
    NORMAL,
    NX,
    NY,
    ROW,
    BodyImpulses,
    PairImpulses,
    WorkScratch,
)
from conveyor_sim.engine.arrays.moving import OFF_PROFILE, MovingBodies
from conveyor_sim.engine.arrays.observers import LedgerArrays
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.impulses.bottles import belt_velocity
from conveyor_sim.engine.observers.ledger import BASE_FRICTION, BELTS, CONTACT_FRICTION, DAMPING
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import BLOCK, UNIT, share, units, wait_for_all


@part
def begin_work(world: World, impulses: Any, h: float, first: int, end: int) -> None:
    """Book the work of belts on bottles first to end, and store the velocities that base friction left."""
    _begin(world, world.ledger, impulses.work, impulses.free, h, first, end)


@part
def _begin(world: World, ledger: Any, work: Any, free: F8, h: float, first: int, end: int) -> None:
    if work is None:
        return
    for i in range(uint64(first), uint64(end)):
        work.start_x[i] = free[uint64(4) * i]
        work.start_y[i] = free[uint64(4) * i + uint64(1)]
        work.impact[i] = 0.0
    _begin_belts(world, world.footing, ledger, work, h, first, end)


@part
def _begin_belts(
    world: World, footing: Any, ledger: LedgerArrays, work: WorkScratch, h: float, first: int, end: int
) -> None:
    bottles = world.bottles
    if footing is None:
        return
    for i in range(first, end):
        if bottles.inverse_mass[i] > 0.0:
            ux, uy = belt_velocity(bottles, footing, h, i)
            gained_x, gained_y = work.start_x[i] - bottles.vx[i], work.start_y[i] - bottles.vy[i]
            done = (gained_x * ux + gained_y * uy) / bottles.inverse_mass[i]
            ledger.work[i // UNIT, BELTS + footing.carrier[i]] += done
            ledger.work[i // UNIT, BASE_FRICTION] += done


@part
def book_impact(
    ledger: LedgerArrays,
    unit: int,
    normal: float,
    along: float,
    separating: float,
    slip: float,
    mass: float,
    turn: float,
) -> None:
    """Book an impact by its impulses (N s) and the velocities before it (m/s); mass, turn: as in `visit`."""
    ledger.work[unit, DAMPING] -= normal * (separating + 0.5 * mass * normal)
    ledger.work[unit, CONTACT_FRICTION] += along * (slip - 0.5 * turn * along)


@part
def note_impact(work: WorkScratch, body: F8, i: int, sign: float, x: float, y: float, turn: float) -> None:
    """Add the kinetic energy that bottle i has just gained by an impulse, sign times (x, y), and by `turn`, N s."""
    b = BODY * i
    along = sign * (x * body[b + 2] + y * body[b + 3]) - 0.5 * body[b + 5] * (x * x + y * y)
    work.impact[i] += along + turn * (body[b + 4] - 0.5 * body[b + 6] * turn)


@part
def mean_velocities(world: World, impulses: Any, first: int, end: int) -> None:
    """Compute the velocities with which work is done on bottles first to end, and book the friction under them.

    It follows the last sweep, before `end_substep`.
    """
    _means(world, world.spin, world.ledger, impulses.work, impulses, first, end)


@part
def _means(world: World, spin: Any, ledger: Any, work: Any, impulses: Any, first: int, end: int) -> None:
    bottles, body, free = world.bottles, impulses.body, impulses.free
    if work is None:
        return
    for i in range(first, end):
        if bottles.inverse_mass[i] > 0.0:
            vx, vy, mass = bottles.vx[i], bottles.vy[i], 1.0 / bottles.inverse_mass[i]
            after_x, after_y = body[BODY * i + 2], body[BODY * i + 3]
            kick_x, kick_y = free[4 * i] - work.start_x[i], free[4 * i + 1] - work.start_y[i]
            x, y = 0.5 * (vx + after_x - kick_x), 0.5 * (vy + after_y - kick_y)
            work.mean.x[i] = x
            work.mean.y[i] = y
            ledger.work[i // UNIT, BASE_FRICTION] -= mass * ((work.start_x[i] - vx) * x + (work.start_y[i] - vy) * y)
            rest = _mean_turn(i, bottles.radius[i], spin, work, body, free)
            if kick_x != 0.0 or kick_y != 0.0 or work.impact[i] != 0.0:
                # Pressed contacts that were visited after an impact worked at other velocities.
                gained = 0.5 * (after_x * after_x + after_y * after_y - vx * vx - vy * vy)
                rest += mass * (gained - (after_x - vx - kick_x) * x - (after_y - vy - kick_y) * y)
                ledger.work[i // UNIT, DAMPING] -= rest - work.impact[i]


@part
def _mean_turn(i: int, radius: float, spin: Any, work: WorkScratch, body: F8, free: F8) -> float:
    """Store the mean rotation of bottle i; return the energy (J) that it gained beyond the work with this mean."""
    if spin is None:
        return 0.0
    before, after = radius * spin.omega[i], body[BODY * i + 4]
    kick = free[4 * i + 2] - before
    mean = 0.5 * (before + after - kick)
    work.mean.turn[i] = mean
    return (0.5 * (after * after - before * before) - (after - before - kick) * mean) / body[BODY * i + 6]


@part
def book_pressed(world: World, worker: Worker, impulses: Any) -> None:
    """Book the work of all pressed contacts in this substep. It must be called after `mean_velocities`."""
    _pressed(world, worker, impulses.work, impulses)


@part
def _pressed(world: World, worker: Worker, work: Any, impulses: Any) -> None:
    if work is None:
        return
    wait_for_all(worker)
    _pairs(worker, world.pairs, world.ledger, work, impulses.body)
    begin, stop = share(worker, world.bottles.x.size)
    for first in range(begin, stop, BLOCK):
        end = min(first + BLOCK, stop)
        _segments(world, world.segments, world.near_segments, work, impulses.body, first, end)
        _arcs(world, world.arcs, world.near_arcs, work, impulses.body, first, end)
        _bodies(world, impulses.bodies, work, first, end)


@part
def _pairs(worker: Worker, pairs: Any, ledger: Any, work: WorkScratch, body: F8) -> None:
    if pairs is None:
        return
    held = pairs.impulse
    for colour in range(COLOURS):
        start, end = held.start[colour], held.start[colour + 1]
        if start == end:
            break
        begin, stop = share(worker, end - start)
        if colour == COLOURS - 1:
            begin, stop = 0, (end - start if worker.rank == 0 else 0)
        for offset in range(begin, stop):
            _pair(held, start + offset, pair_unit(ledger, offset), ledger, work.mean, body)
        wait_for_all(worker)


@part
def pair_unit(ledger: LedgerArrays, offset: int) -> int:
    """Return the row of accounts of the pair at an offset in its colour; one thread at a time writes to it."""
    # Only the last colour, which one thread takes, may have more pairs than there are rows.
    return min(offset // UNIT, ledger.work.shape[0] - 1)


@part
def _pair(held: PairImpulses, p: int, unit: int, ledger: LedgerArrays, mean: Any, body: F8) -> None:
    i, j = int(held.i[p]), int(held.j[p])
    x, y = body[BODY * j] - body[BODY * i], body[BODY * j + 1] - body[BODY * i + 1]
    inverse = 1.0 / math.sqrt(x * x + y * y)
    vx, vy, rim = mean.x[j] - mean.x[i], mean.y[j] - mean.y[i], mean.turn[i] + mean.turn[j]
    book_work(ledger, unit, held.row, ROW * p, x * inverse, y * inverse, vx, vy, rim)


@part
def _segments(world: World, segments: Any, near: Any, work: WorkScratch, body: F8, first: int, end: int) -> None:
    if segments is None:
        return
    margin = 0.5 * world.settings.skin
    begin, stop = units(first, end)
    for place in range(world.railed.first[begin], world.railed.first[stop]):
        i = int(world.railed.bottle[place])
        for entry in range(near.start[i], near.start[i + 1]):
            x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
            _, nx, ny = segment_contact(segments, near.piece[entry], x, y, radius + margin)
            _book_rail(world.ledger, near.impulse.row, ROW * entry, i, nx, ny, work)


@part
def _arcs(world: World, arcs: Any, near: Any, work: WorkScratch, body: F8, first: int, end: int) -> None:
    if arcs is None:
        return
    margin = 0.5 * world.settings.skin
    begin, stop = units(first, end)
    for place in range(world.railed.first[begin], world.railed.first[stop]):
        i = int(world.railed.bottle[place])
        for entry in range(near.start[i], near.start[i + 1]):
            x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
            _, nx, ny = arc_contact(arcs, near.piece[entry], x, y, radius + margin)
            _book_rail(world.ledger, near.impulse.row, ROW * entry, i, nx, ny, work)


@part
def _bodies(world: World, bodies: Any, work: WorkScratch, first: int, end: int) -> None:
    if bodies is None:
        return
    moving, mean, geometry = world.moving, work.mean, bodies.geometry
    begin, stop = units(first, end)
    for entry in range(world.railed.first[begin], world.railed.first[stop]):
        i = int(world.railed.bottle[entry])
        for place in range(CONTACTS * i, CONTACTS * i + CONTACTS):
            if bodies.piece[place] >= 0:
                row, g, a = ROW * place, GEOMETRY * place, bodies.axis[place]
                speed = _mean_speed(moving, moving.actuators, bodies, a)
                ux, uy = _surface(geometry, g, speed)
                vx, vy, rim = ux - mean.x[i], uy - mean.y[i], mean.turn[i]
                book_work(world.ledger, i // UNIT, bodies.row, row, geometry[g + NX], geometry[g + NY], vx, vy, rim)
                book_body(world.ledger, moving, bodies, i, place, bodies.row[row], bodies.row[row + 1], speed)


@part
def _mean_speed(moving: MovingBodies, actuators: Any, bodies: BodyImpulses, a: int) -> float:
    """Return the mean speed in the substep of an axis off its profile; 0 on it."""
    if actuators is None:
        return 0.0
    if a < 0:
        return 0.0
    return 0.5 * (moving.speed[a] + bodies.speed[a]) if actuators.mode[a] == OFF_PROFILE else 0.0


@part
def _surface(geometry: F8, g: int, speed: float) -> tuple[float, float]:
    """Return the velocity (m/s) of a body at a contact; speed: of an axis off its profile."""
    along = geometry[g + NORMAL] + speed * geometry[g + AHEAD]
    aside = geometry[g + ACROSS] + speed * geometry[g + ASIDE]
    nx, ny = geometry[g + NX], geometry[g + NY]
    return along * nx - aside * ny, along * ny + aside * nx


@part
def book_body(
    ledger: LedgerArrays, moving: Any, bodies: BodyImpulses, i: int, place: int, x: float, y: float, speed: float
) -> None:
    """Book the work of a body on bottle i by the impulse (x, y), N s, of the bottle on it, to its machine.

    speed: mean, of an axis off its profile.
    """
    ux, uy = _surface(bodies.geometry, GEOMETRY * place, speed)
    machine = BELTS + ledger.belt_power.shape[1] + moving.account[moving.body[bodies.piece[place]]]
    ledger.work[i // UNIT, machine] -= x * ux + y * uy


@part
def _book_rail(ledger: Any, rows: F8, row: int, i: int, nx: float, ny: float, work: WorkScratch) -> None:
    mean = work.mean
    book_work(ledger, i // UNIT, rows, row, nx, ny, -mean.x[i], -mean.y[i], mean.turn[i])


@part
def book_work(
    ledger: LedgerArrays, unit: int, rows: F8, row: int, nx: float, ny: float, vx: float, vy: float, rim: float
) -> None:
    """Book the work of a held impulse. vx, vy: mean velocity of the second body relative to the first, m/s.

    rim: mean sum of R omega, m/s.
    """
    x, y, turn = rows[row], rows[row + 1], rows[row + 2]
    if x == 0.0 and y == 0.0:
        return
    normal = (x * nx + y * ny) * (vx * nx + vy * ny)
    ledger.work[unit, DAMPING] -= normal
    ledger.work[unit, CONTACT_FRICTION] -= x * vx + y * vy + turn * rim - normal

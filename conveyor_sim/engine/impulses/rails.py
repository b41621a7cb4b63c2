# SPDX-License-Identifier: Apache-2.0
"""A sweep over the contacts of bottles with rails at rest, bottle by bottle."""

from typing import Any

from conveyor_sim.engine.arrays.impulses import BODY, CONSTANTS, ROW
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
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
    MASS_INVERSE,
    OPEN,
    PEAK,
    REBOUND,
    TURN,
    TURN_INVERSE,
)
from conveyor_sim.engine.impulses.law import visit
from conveyor_sim.engine.impulses.loads import note_blow, note_pressed
from conveyor_sim.engine.impulses.pairs import FARTHER, NEARER, note_peak
from conveyor_sim.engine.impulses.runs import sleeps
from conveyor_sim.engine.impulses.work import book_impact, note_impact
from conveyor_sim.engine.observers.damage import rail_bin, wear
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import UNIT, units

FAR = 1e3
"""Gap (m) to a piece that is out of reach: an impulse that the contact still holds is released."""


@part
def sweep_rails(world: World, impulses: Any, h: float, threshold: float, last: bool, first: int, end: int) -> None:
    """Visit every contact of bottles first to end with rails once (`sweep_pairs`)."""
    railed = world.railed
    if railed is None:
        return
    begin, stop = units(first, end)
    for place in range(railed.first[begin], railed.first[stop]):
        i = railed.bottle[place]
        if sleeps(impulses.sleep, i):
            continue
        _segments(i, world, world.segments, world.near_segments, impulses, h, threshold, last)
        _arcs(i, world, world.arcs, world.near_arcs, impulses, h, threshold, last)


@part
def _segments(
    i: int, world: World, segments: Any, near: Any, impulses: Any, h: float, threshold: float, last: bool
) -> None:
    if segments is None:
        return
    body, margin = impulses.body, 0.5 * world.settings.skin
    for entry in range(near.start[i], near.start[i + 1]):
        g = near.piece[entry]
        x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
        overlap, nx, ny = segment_contact(segments, g, x, y, radius + margin)
        key = -1 - 2 * int(g)
        _visit(
            i, world, near.impulse.row, entry, segments.material[g], key, overlap, nx, ny, impulses, h, threshold, last
        )


@part
def _arcs(i: int, world: World, arcs: Any, near: Any, impulses: Any, h: float, threshold: float, last: bool) -> None:
    if arcs is None:
        return
    body, margin = impulses.body, 0.5 * world.settings.skin
    for entry in range(near.start[i], near.start[i + 1]):
        k = near.piece[entry]
        x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
        overlap, nx, ny = arc_contact(arcs, k, x, y, radius + margin)
        key = -2 - 2 * int(k)
        _visit(i, world, near.impulse.row, entry, arcs.material[k], key, overlap, nx, ny, impulses, h, threshold, last)


@part
def _visit(
    i: int,
    world: World,
    rows: F8,
    entry: int,
    material: int,
    key: int,
    overlap: float,
    nx: float,
    ny: float,
    impulses: Any,
    h: float,
    threshold: float,
    last: bool,
) -> None:
    """Visit a contact of bottle i. key: of the piece (`observers/damage.py`).

    overlap: m, beyond half of the skin around the bottle.
    """
    body, free, b, row = impulses.body, impulses.free, BODY * i, ROW * entry
    near = overlap > 0.0
    nx, ny = (nx, ny) if near else (1.0, 0.0)
    gap = 0.5 * world.settings.skin - overlap if near else FAR
    vx, vy = -body[b + 2], -body[b + 3]
    idle = rows[row] == 0.0 and rows[row + 1] == 0.0 and rows[row + 2] == 0.0 and rows[row + 3] == 0.0
    if idle and gap > FARTHER + h * NEARER * (abs(vx) + abs(vy)):
        return
    slip = vy * nx - vx * ny - body[b + 4]
    table = impulses.rail_constants
    kind = CONSTANTS * (world.bottles.type[i] * world.settings.rail_materials + material)
    x, y, turn, new_x, new_y, new_turn, wait, shift_x, shift_y, act, normal, speed = visit(
        rows[row],
        rows[row + 1],
        rows[row + 2],
        rows[row + 3],
        nx,
        ny,
        gap,
        vx * nx + vy * ny,
        slip,
        table[kind + MASS],
        table[kind + MASS_INVERSE],
        table[kind + TURN],
        table[kind + TURN_INVERSE],
        table[kind + OPEN],
        table[kind + CLOSED],
        table[kind + GAIN_OPEN],
        table[kind + GAIN_CLOSED],
        table[kind + COMPLIANCE],
        table[kind + REBOUND],
        table[kind + FRICTION],
        table[kind + APART],
        table[kind + FASTEST],
        threshold,
        world.settings.slip_limit,
        h,
    )
    rows[row + 3] = wait
    if act == 0.0:
        return
    mass = body[b + 5]
    turned = body[b + 6] * turn
    body[b] -= mass * shift_x
    body[b + 1] -= mass * shift_y
    body[b + 2] -= mass * x
    body[b + 3] -= mass * y
    body[b + 4] += turned
    rows[row] = new_x
    rows[row + 1] = new_y
    rows[row + 2] = new_turn
    if act > 1.0:
        free[4 * i] -= mass * x
        free[4 * i + 1] -= mass * y
        free[4 * i + 2] += turned
    peak = -speed * table[kind + PEAK]
    _note(world.peaks, i, act, peak, normal, h, last)
    _book(world.ledger, impulses.work, body, i, act, normal, x, y, turn, speed, slip, table[kind + TURN])
    ended = slip + mass * (y * nx - x * ny) - turned
    if act > 1.0:
        _load_blow(world, world.damage, impulses.loads, i, key, nx, ny, normal, x, y, turn, slip + ended, -speed, peak)
    elif last and normal > 0.0:
        _load(world, world.damage, impulses.loads, i, key, nx, ny, normal, new_x, new_y, new_turn, ended, h)


@part
def _note(peaks: Any, i: int, act: float, impact: float, normal: float, h: float, last: bool) -> None:
    if peaks is None:
        return
    if act > 1.0:
        note_peak(peaks, i, impact, normal)
    elif last and normal > 0.0:
        note_peak(peaks, i, normal / h, normal)


@part
def _book(
    ledger: Any,
    work: Any,
    body: F8,
    i: int,
    act: float,
    normal: float,
    x: float,
    y: float,
    along: float,
    separating: float,
    slip: float,
    turn: float,
) -> None:
    """Book an impact of bottle i on a rail in the energy ledger."""
    if work is None:
        return
    if act > 1.0:
        book_impact(ledger, i // UNIT, normal, along, separating, slip, body[BODY * i + 5], turn)
        note_impact(work, body, i, -1.0, x, y, along)


@part
def _load(
    world: World,
    damage: Any,
    loads: Any,
    i: int,
    key: int,
    nx: float,
    ny: float,
    normal: float,
    x: float,
    y: float,
    along: float,
    slip: float,
    h: float,
) -> None:
    """Note a pressed contact of bottle i with a rail, as a load on both."""
    if loads is None:
        return
    work = abs(along * slip)
    note_pressed(damage, loads, i, -1.0, x, y, nx, ny, normal, work, h)
    _wear(world, damage.scuffing, i, key, nx, ny, work, normal)


@part
def _load_blow(
    world: World,
    damage: Any,
    loads: Any,
    i: int,
    key: int,
    nx: float,
    ny: float,
    normal: float,
    x: float,
    y: float,
    along: float,
    slips: float,
    speed: float,
    peak: float,
) -> None:
    """Note an impact of bottle i on a rail. slips: sum of the slips before and after it, m/s."""
    if loads is None:
        return
    work = abs(0.5 * along * slips)
    note_blow(damage, loads, i, -x, -y, speed, peak, work)
    _wear(world, damage.scuffing, i, key, nx, ny, work, normal)


@part
def _wear(world: World, scuffing: Any, i: int, key: int, nx: float, ny: float, work: float, normal: float) -> None:
    if scuffing is None:
        return
    body = world.impulses.body
    x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
    place = rail_bin(scuffing, world.segments, world.arcs, key, x + radius * nx, y + radius * ny)
    wear(scuffing.bins, i // UNIT, place, work, normal)

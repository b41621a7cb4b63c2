# SPDX-License-Identifier: Apache-2.0
"""A sweep over all pairs, colour by colour, in chunks: gather, law, scatter.

No two pairs of a colour share a bottle, so its pairs can be divided among threads and taken in any order: the bits are
the same. The columns of a chunk lie in one array at constant distances. LLVM vectorises the law only then.

A pair that holds nothing and can't touch in this substep is left out of its chunk: the law would change nothing. In a
line these are four of five pairs. Constants are read by pair only in chunks whose pairs differ in kind.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.impulses import BODY, COLOURS, CONSTANTS, ROW, PairImpulses
from conveyor_sim.engine.arrays.types import F8, I8
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
    MASS_INVERSE,
    OPEN,
    PEAK,
    REACH,
    REBOUND,
    TURN,
    TURN_INVERSE,
)
from conveyor_sim.engine.impulses.law import visit
from conveyor_sim.engine.impulses.loads import note_blow, note_pressed
from conveyor_sim.engine.impulses.runs import end_of_awake
from conveyor_sim.engine.impulses.work import book_impact, note_impact, pair_unit
from conveyor_sim.engine.threads.workers import CHUNK, share, wait_for_all

_ROW, _BODY, _KINDS, _FREE = uint64(ROW), uint64(BODY), uint64(CONSTANTS), uint64(4)

# Columns of a chunk: differences of positions and velocities, sum of R omega, row of the pair, then results.
_X, _Y, _VX, _VY, _RIM = (uint64(CHUNK * column) for column in range(5))
_HELD_X, _HELD_Y, _HELD_TURN, _WAIT = (uint64(CHUNK * column) for column in range(5, 9))
_CHANGE_X, _CHANGE_Y, _CHANGE_TURN = (uint64(CHUNK * column) for column in range(9, 12))
_NEW_X, _NEW_Y, _NEW_TURN, _NEW_WAIT = (uint64(CHUNK * column) for column in range(12, 16))
_SHIFT_X, _SHIFT_Y, _ACT, _NORMAL, _SPEED = (uint64(CHUNK * column) for column in range(16, 21))
_FIRST = 21
"""First column of the constants of each pair, if these differ."""

NEARER, FARTHER = 1.001, 1e-9
"""Margins for rounding in the test of contacts that can't touch: factor of the way, and distance, m."""


@part
def sweep_pairs(world: World, worker: Worker, impulses: Any, h: float, threshold: float, last: bool) -> None:
    """Visit every pair once. last: this is the last sweep of the substep of h (s). On return all pairs are done."""
    if world.pairs is None:
        return
    _sweep(world, worker, impulses, world.pairs.impulse, h, threshold, last)


@part
def _sweep(
    world: World, worker: Worker, impulses: Any, pairs: PairImpulses, h: float, threshold: float, last: bool
) -> None:
    for colour in range(COLOURS):
        start, end = pairs.start[colour], end_of_awake(impulses.sleep, pairs, colour)
        if start == pairs.start[colour + 1]:
            break
        if start == end:
            continue
        begin, stop = share(worker, end - start)
        if colour == COLOURS - 1:
            # These pairs may share bottles, so one thread takes them all.
            begin, stop = 0, (end - start if worker.rank == 0 else 0)
        next_pair = start + begin
        while next_pair < start + stop:
            next_pair, count = _gather(impulses, pairs, worker.chunk, worker.listed, h, next_pair, start + stop)
            _solve_chunk(worker, impulses, impulses.alike, pairs, threshold, world.settings.slip_limit, h, count)
            _scatter(impulses, pairs, worker.chunk, worker.listed, count)
            _note(world.peaks, impulses, pairs, worker.chunk, worker.listed, h, last, count)
            _book(world.ledger, impulses.work, impulses, pairs, worker.chunk, worker.listed, start, count)
            _load(world.damage, impulses.loads, impulses, pairs, worker.chunk, worker.listed, h, last, count)
        wait_for_all(worker)


@part
def _gather(
    impulses: Any, pairs: PairImpulses, chunk: F8, listed: I8, h: float, first: int, end: int
) -> tuple[int, int]:
    """Fill a chunk with pairs from first on that may act. Return the next pair, at most end, and the number filled."""
    body = impulses.body
    p, c = uint64(first), uint64(0)
    while p < uint64(end) and c < uint64(CHUNK):
        a, b, row = uint64(pairs.i[p]) * _BODY, uint64(pairs.j[p]) * _BODY, p * _ROW
        x, y = body[b] - body[a], body[b + uint64(1)] - body[a + uint64(1)]
        vx, vy = body[b + uint64(2)] - body[a + uint64(2)], body[b + uint64(3)] - body[a + uint64(3)]
        held_x, held_y, held_turn = pairs.row[row], pairs.row[row + uint64(1)], pairs.row[row + uint64(2)]
        wait = pairs.row[row + uint64(3)]
        reach = body[a + uint64(7)] + body[b + uint64(7)] + FARTHER + h * NEARER * (abs(vx) + abs(vy))
        idle = (held_x == 0.0) & (held_y == 0.0) & (held_turn == 0.0) & (wait == 0.0) & (x * x + y * y > reach * reach)
        if not idle:
            chunk[_X + c], chunk[_Y + c] = x, y
            chunk[_VX + c], chunk[_VY + c] = vx, vy
            chunk[_RIM + c] = body[b + uint64(4)] + body[a + uint64(4)]
            chunk[_HELD_X + c], chunk[_HELD_Y + c], chunk[_HELD_TURN + c] = held_x, held_y, held_turn
            chunk[_WAIT + c] = wait
            listed[c] = p
            c += uint64(1)
        p += uint64(1)
    return int(p), int(c)


@part
def _solve_chunk(
    worker: Worker,
    impulses: Any,
    alike: Any,
    pairs: PairImpulses,
    threshold: float,
    slip_limit: float,
    h: float,
    count: int,
) -> None:
    """Apply the law to a chunk, with constants by pair only if its pairs differ in kind."""
    if count == 0:
        return
    chunk, listed = worker.chunk, worker.listed
    if alike is None:
        if not _is_uniform(pairs, listed, count):
            _gather_constants(impulses, pairs, chunk, listed, count)
            _solve(chunk, impulses, None, 0, threshold, slip_limit, h, count)
            return
    _solve(chunk, impulses, 1, CONSTANTS * pairs.kind[listed[0]], threshold, slip_limit, h, count)


@part
def _is_uniform(pairs: PairImpulses, listed: I8, count: int) -> bool:
    kind, other = pairs.kind[listed[0]], 0
    for c in range(uint64(count)):
        other |= pairs.kind[listed[c]] != kind
    return other == 0


@part
def _gather_constants(impulses: Any, pairs: PairImpulses, chunk: F8, listed: I8, count: int) -> None:
    for c in range(uint64(count)):
        kind = uint64(pairs.kind[listed[c]]) * _KINDS
        for constant in range(uint64(PEAK)):
            chunk[uint64(CHUNK) * (uint64(_FIRST) + constant) + c] = impulses.pair_constants[kind + constant]


@part
def _constant(chunk: F8, alike: Any, common: float, number: int, c: int) -> float:
    if alike is None:
        return chunk[uint64(CHUNK * (_FIRST + number)) + c]
    return common


@part
def _solve(
    chunk: F8, impulses: Any, alike: Any, kind: int, threshold: float, slip_limit: float, h: float, count: int
) -> None:
    """Apply the law to a chunk. alike: None if constants differ by pair; else they are those at `kind` of the table."""
    table = impulses.pair_constants
    reach, mass, mass_inverse = table[kind + REACH], table[kind + MASS], table[kind + MASS_INVERSE]
    turn, turn_inverse = table[kind + TURN], table[kind + TURN_INVERSE]
    open_rate, closed_rate = table[kind + OPEN], table[kind + CLOSED]
    open_gain, closed_gain, compliance = table[kind + GAIN_OPEN], table[kind + GAIN_CLOSED], table[kind + COMPLIANCE]
    rebound, friction = table[kind + REBOUND], table[kind + FRICTION]
    apart, fastest = table[kind + APART], table[kind + FASTEST]
    for c in range(uint64(count)):
        x, y, vx, vy = chunk[_X + c], chunk[_Y + c], chunk[_VX + c], chunk[_VY + c]
        distance = math.sqrt(x * x + y * y)
        inverse = 1.0 / distance
        # Coincident centres have no normal; any one parts them, the same as in explicit steps.
        nx = x * inverse if distance > 0.0 else 1.0
        ny = y * inverse if distance > 0.0 else 0.0
        change_x, change_y, change_turn, new_x, new_y, new_turn, wait, shift_x, shift_y, act, normal, speed = visit(
            chunk[_HELD_X + c],
            chunk[_HELD_Y + c],
            chunk[_HELD_TURN + c],
            chunk[_WAIT + c],
            nx,
            ny,
            distance - _constant(chunk, alike, reach, REACH, c),
            vx * nx + vy * ny,
            vy * nx - vx * ny - chunk[_RIM + c],
            _constant(chunk, alike, mass, MASS, c),
            _constant(chunk, alike, mass_inverse, MASS_INVERSE, c),
            _constant(chunk, alike, turn, TURN, c),
            _constant(chunk, alike, turn_inverse, TURN_INVERSE, c),
            _constant(chunk, alike, open_rate, OPEN, c),
            _constant(chunk, alike, closed_rate, CLOSED, c),
            _constant(chunk, alike, open_gain, GAIN_OPEN, c),
            _constant(chunk, alike, closed_gain, GAIN_CLOSED, c),
            _constant(chunk, alike, compliance, COMPLIANCE, c),
            _constant(chunk, alike, rebound, REBOUND, c),
            _constant(chunk, alike, friction, FRICTION, c),
            _constant(chunk, alike, apart, APART, c),
            _constant(chunk, alike, fastest, FASTEST, c),
            threshold,
            slip_limit,
            h,
        )
        chunk[_CHANGE_X + c] = change_x
        chunk[_CHANGE_Y + c] = change_y
        chunk[_CHANGE_TURN + c] = change_turn
        chunk[_NEW_X + c] = new_x
        chunk[_NEW_Y + c] = new_y
        chunk[_NEW_TURN + c] = new_turn
        chunk[_NEW_WAIT + c] = wait
        chunk[_SHIFT_X + c] = shift_x
        chunk[_SHIFT_Y + c] = shift_y
        chunk[_ACT + c] = act
        chunk[_NORMAL + c] = normal
        chunk[_SPEED + c] = speed


@part
def _scatter(impulses: Any, pairs: PairImpulses, chunk: F8, listed: I8, count: int) -> None:
    body, free = impulses.body, impulses.free
    for c in range(uint64(count)):
        p, act = uint64(listed[c]), chunk[_ACT + c]
        row = p * _ROW
        pairs.row[row + uint64(3)] = chunk[_NEW_WAIT + c]
        if act == 0.0:
            continue
        a, b = uint64(pairs.i[p]) * _BODY, uint64(pairs.j[p]) * _BODY
        mass_a, mass_b = body[a + uint64(5)], body[b + uint64(5)]
        x, y, turn = chunk[_CHANGE_X + c], chunk[_CHANGE_Y + c], chunk[_CHANGE_TURN + c]
        turn_a, turn_b = body[a + uint64(6)] * turn, body[b + uint64(6)] * turn
        body[a] -= mass_a * chunk[_SHIFT_X + c]
        body[a + uint64(1)] -= mass_a * chunk[_SHIFT_Y + c]
        body[a + uint64(2)] -= mass_a * x
        body[a + uint64(3)] -= mass_a * y
        body[a + uint64(4)] += turn_a
        body[b] += mass_b * chunk[_SHIFT_X + c]
        body[b + uint64(1)] += mass_b * chunk[_SHIFT_Y + c]
        body[b + uint64(2)] += mass_b * x
        body[b + uint64(3)] += mass_b * y
        body[b + uint64(4)] += turn_b
        pairs.row[row] = chunk[_NEW_X + c]
        pairs.row[row + uint64(1)] = chunk[_NEW_Y + c]
        pairs.row[row + uint64(2)] = chunk[_NEW_TURN + c]
        if act > 1.0:
            a, b = uint64(pairs.i[p]) * _FREE, uint64(pairs.j[p]) * _FREE
            free[a] -= mass_a * x
            free[a + uint64(1)] -= mass_a * y
            free[a + uint64(2)] += turn_a
            free[b] += mass_b * x
            free[b + uint64(1)] += mass_b * y
            free[b + uint64(2)] += turn_b


@part
def _note(
    peaks: Any, impulses: Any, pairs: PairImpulses, chunk: F8, listed: I8, h: float, last: bool, count: int
) -> None:
    """Update peaks by impacts and, in the last sweep, by the impulses of pressed contacts."""
    if peaks is None:
        return
    for c in range(uint64(count)):
        p, act, normal = uint64(listed[c]), chunk[_ACT + c], chunk[_NORMAL + c]
        if act > 1.0:
            peak = impulses.pair_constants[uint64(pairs.kind[p]) * _KINDS + uint64(PEAK)]
            note_peak(peaks, uint64(pairs.i[p]), -chunk[_SPEED + c] * peak, normal)
            note_peak(peaks, uint64(pairs.j[p]), -chunk[_SPEED + c] * peak, normal)
        elif last and normal > 0.0:
            note_peak(peaks, uint64(pairs.i[p]), normal / h, normal)
            note_peak(peaks, uint64(pairs.j[p]), normal / h, normal)


@part
def note_peak(peaks: Any, i: int, force: float, impulse: float) -> None:
    """Update a bottle's largest normal force (N) and the sum of its normal impulses (N s)."""
    peaks.force[i] = force if force > peaks.force[i] else peaks.force[i]
    peaks.impulse[i] += impulse


@part
def _book(
    ledger: Any, work: Any, impulses: Any, pairs: PairImpulses, chunk: F8, listed: I8, start: int, count: int
) -> None:
    """Book the impacts of a chunk in the energy ledger. start: first pair of the colour."""
    if work is None:
        return
    for c in range(count):
        if chunk[_ACT + c] > 1.0:
            p = listed[c]
            kind = int(pairs.kind[p]) * CONSTANTS
            mass, turn = impulses.pair_constants[kind + MASS], impulses.pair_constants[kind + TURN]
            slip, along = _slip(chunk, c), chunk[_CHANGE_TURN + c]
            unit = pair_unit(ledger, p - start)
            book_impact(ledger, unit, chunk[_NORMAL + c], along, chunk[_SPEED + c], slip, mass, turn)
            x, y = chunk[_CHANGE_X + c], chunk[_CHANGE_Y + c]
            note_impact(work, impulses.body, int(pairs.i[p]), -1.0, x, y, along)
            note_impact(work, impulses.body, int(pairs.j[p]), 1.0, x, y, along)


@part
def _slip(chunk: F8, c: int) -> float:
    """Return the slip of a pair before its visit, m/s."""
    x, y = chunk[_X + c], chunk[_Y + c]
    inverse = 1.0 / math.sqrt(x * x + y * y)
    return (chunk[_VY + c] * x - chunk[_VX + c] * y) * inverse - chunk[_RIM + c]


@part
def _load(
    damage: Any,
    loads: Any,
    impulses: Any,
    pairs: PairImpulses,
    chunk: F8,
    listed: I8,
    h: float,
    last: bool,
    count: int,
) -> None:
    """Note loads by impacts and, in the last sweep, by pressed contacts."""
    if loads is None:
        return
    for c in range(count):
        act, normal = chunk[_ACT + c], chunk[_NORMAL + c]
        if act > 1.0 or (last and normal > 0.0):
            p = listed[c]
            i, j, kind = int(pairs.i[p]), int(pairs.j[p]), int(pairs.kind[p]) * CONSTANTS
            along, x, y = _total(chunk, c)
            before = _slip(chunk, c)
            after = before + _change_of_slip(impulses.pair_constants, kind, chunk, c)
            if act > 1.0:
                speed = -chunk[_SPEED + c]
                peak, work = speed * impulses.pair_constants[kind + PEAK], abs(along * 0.5 * (before + after))
                note_blow(damage, loads, i, -x, -y, speed, peak, work)
                note_blow(damage, loads, j, x, y, speed, peak, work)
            else:
                px, py, work = chunk[_X + c], chunk[_Y + c], abs(along * after)
                inverse = 1.0 / math.sqrt(px * px + py * py)
                nx, ny = px * inverse, py * inverse
                note_pressed(damage, loads, i, -1.0, x, y, nx, ny, normal, work, h)
                note_pressed(damage, loads, j, 1.0, x, y, nx, ny, normal, work, h)


@part
def _total(chunk: F8, c: int) -> tuple[float, float, float]:
    """Return the impulse of a pair after its visit: of friction, and as a vector on the second bottle, N s."""
    along = chunk[_HELD_TURN + c] + chunk[_CHANGE_TURN + c]
    return along, chunk[_HELD_X + c] + chunk[_CHANGE_X + c], chunk[_HELD_Y + c] + chunk[_CHANGE_Y + c]


@part
def _change_of_slip(table: F8, kind: int, chunk: F8, c: int) -> float:
    x, y = chunk[_X + c], chunk[_Y + c]
    inverse = 1.0 / math.sqrt(x * x + y * y)
    moved = (chunk[_CHANGE_Y + c] * x - chunk[_CHANGE_X + c] * y) * inverse * table[kind + MASS]
    return moved - chunk[_CHANGE_TURN + c] * (table[kind + TURN] - table[kind + MASS])

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
from conveyor_sim.engine.impulses.pairs import note_peak
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.segment import segment_contact
from conveyor_sim.engine.threads.workers import units

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
        _visit(i, world, near.impulse.row, entry, segments.material[g], overlap, nx, ny, impulses, h, threshold, last)


@part
def _arcs(i: int, world: World, arcs: Any, near: Any, impulses: Any, h: float, threshold: float, last: bool) -> None:
    if arcs is None:
        return
    body, margin = impulses.body, 0.5 * world.settings.skin
    for entry in range(near.start[i], near.start[i + 1]):
        k = near.piece[entry]
        x, y, radius = body[BODY * i], body[BODY * i + 1], body[BODY * i + 7]
        overlap, nx, ny = arc_contact(arcs, k, x, y, radius + margin)
        _visit(i, world, near.impulse.row, entry, arcs.material[k], overlap, nx, ny, impulses, h, threshold, last)


@part
def _visit(
    i: int,
    world: World,
    rows: F8,
    entry: int,
    material: int,
    overlap: float,
    nx: float,
    ny: float,
    impulses: Any,
    h: float,
    threshold: float,
    last: bool,
) -> None:
    """Visit a contact of bottle i. overlap: m, beyond half of the skin around the bottle."""
    body, free, b, row = impulses.body, impulses.free, BODY * i, ROW * entry
    near = overlap > 0.0
    nx, ny = (nx, ny) if near else (1.0, 0.0)
    gap = 0.5 * world.settings.skin - overlap if near else FAR
    vx, vy = -body[b + 2], -body[b + 3]
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
        vy * nx - vx * ny - body[b + 4],
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
    turn = body[b + 6] * turn
    body[b] -= mass * shift_x
    body[b + 1] -= mass * shift_y
    body[b + 2] -= mass * x
    body[b + 3] -= mass * y
    body[b + 4] += turn
    rows[row] = new_x
    rows[row + 1] = new_y
    rows[row + 2] = new_turn
    if act > 1.0:
        free[4 * i] -= mass * x
        free[4 * i + 1] -= mass * y
        free[4 * i + 2] += turn
    _note(world.peaks, i, act, -speed * table[kind + PEAK], normal, h, last)


@part
def _note(peaks: Any, i: int, act: float, impact: float, normal: float, h: float, last: bool) -> None:
    if peaks is None:
        return
    if act > 1.0:
        note_peak(peaks, i, impact, normal)
    elif last and normal > 0.0:
        note_peak(peaks, i, normal / h, normal)

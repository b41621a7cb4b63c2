# SPDX-License-Identifier: Apache-2.0
"""Contacts of the method of impulses as columns: forces are the held impulses divided by the substep; read-only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.impulses import CONTACTS, ROW
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.moving import piece_contact
from conveyor_sim.engine.rails.segment import segment_contact


@kernel
def list_impulses(world: World, kind: NDArray[np.uint8], a: I8, b: I8, values: F8) -> int:
    """Write the contacts that overlap or hold an impulse; arguments and result as in `list_contacts`.

    Impacts hold no impulse, so none is listed. Without an overlap, 0 is written for it.
    """
    count = _pairs(world, kind, a, b, values)
    count = _segments(world, world.segments, world.near_segments, kind, a, b, values, count)
    count = _arcs(world, world.arcs, world.near_arcs, kind, a, b, values, count)
    return _bodies(world, world.moving, world.impulses.bodies, kind, a, b, values, count)


@part
def _pairs(world: World, kind: Any, a: I8, b: I8, values: F8) -> int:
    bottles, pairs = world.bottles, world.pairs
    if pairs is None:
        return 0
    count = 0
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        dx, dy = bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i]
        distance = math.sqrt(dx * dx + dy * dy)
        overlap = bottles.radius[i] + bottles.radius[j] - distance
        row = pairs.impulse.row, ROW * pairs.impulse.place[p]
        if overlap > 0.0 or _holds(row):
            if count < kind.size:
                kind[count] = 0
                a[count] = i
                b[count] = j
                arm = bottles.radius[i] - 0.5 * max(overlap, 0.0)
                _write(world, values, count, i, dx / distance, dy / distance, overlap, arm, row)
            count += 1
    return count


@part
def _segments(world: World, segments: Any, near: Any, kind: Any, a: I8, b: I8, values: F8, count: int) -> int:
    if segments is None:
        return count
    bottles, margin = world.bottles, 0.5 * world.settings.skin
    for i in range(bottles.x.size):
        for entry in range(near.start[i], near.start[i + 1]):
            g = near.piece[entry]
            overlap, nx, ny = segment_contact(segments, g, bottles.x[i], bottles.y[i], bottles.radius[i] + margin)
            row = near.impulse.row, ROW * entry
            if overlap > margin or (overlap > 0.0 and _holds(row)):
                if count < kind.size:
                    _write_rail(world, kind, a, b, values, count, i, segments.rail[g], nx, ny, overlap - margin, row)
                count += 1
    return count


@part
def _arcs(world: World, arcs: Any, near: Any, kind: Any, a: I8, b: I8, values: F8, count: int) -> int:
    if arcs is None:
        return count
    bottles, margin = world.bottles, 0.5 * world.settings.skin
    for i in range(bottles.x.size):
        for entry in range(near.start[i], near.start[i + 1]):
            k = near.piece[entry]
            overlap, nx, ny = arc_contact(arcs, k, bottles.x[i], bottles.y[i], bottles.radius[i] + margin)
            row = near.impulse.row, ROW * entry
            if overlap > margin or (overlap > 0.0 and _holds(row)):
                if count < kind.size:
                    _write_rail(world, kind, a, b, values, count, i, arcs.rail[k], nx, ny, overlap - margin, row)
                count += 1
    return count


@part
def _bodies(world: World, moving: Any, bodies: Any, kind: Any, a: I8, b: I8, values: F8, count: int) -> int:
    if bodies is None:
        return count
    bottles, margin = world.bottles, 0.5 * world.settings.skin
    for place in range(bodies.piece.size):
        if bodies.piece[place] >= 0:
            i = place // CONTACTS
            x, y, radius = bottles.x[i], bottles.y[i], bottles.radius[i]
            overlap, nx, ny, rail = piece_contact(moving, bodies.piece[place], x, y, radius + margin)
            row = bodies.row, ROW * place
            if overlap > margin or (overlap > 0.0 and _holds(row)):
                if count < kind.size:
                    _write_rail(world, kind, a, b, values, count, i, rail, nx, ny, overlap - margin, row)
                count += 1
    return count


@part
def _holds(row: Any) -> bool:
    rows, first = row
    return rows[first] != 0.0 or rows[first + 1] != 0.0


@part
def _write_rail(
    world: World,
    kind: Any,
    a: I8,
    b: I8,
    values: F8,
    count: int,
    i: int,
    rail: int,
    nx: float,
    ny: float,
    overlap: float,
    row: Any,
) -> None:
    kind[count] = 1
    a[count] = i
    b[count] = rail
    _write(world, values, count, i, nx, ny, overlap, world.bottles.radius[i] - max(overlap, 0.0), row)


@part
def _write(
    world: World, values: F8, c: int, i: int, nx: float, ny: float, overlap: float, arm: float, row: Any
) -> None:
    """Write the columns of contact c. arm: m, from the axis of bottle i to the contact point."""
    rows, first = row
    x, y, step = rows[first], rows[first + 1], world.impulses.step[0]
    values[0, c] = world.bottles.x[i] + arm * nx
    values[1, c] = world.bottles.y[i] + arm * ny
    values[2, c] = nx
    values[3, c] = ny
    values[4, c] = max(overlap, 0.0)
    values[5, c] = max(x * nx + y * ny, 0.0) / step if step > 0.0 else 0.0
    values[6, c] = (x * ny - y * nx) / step if step > 0.0 else 0.0

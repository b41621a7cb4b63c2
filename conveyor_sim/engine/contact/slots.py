# SPDX-License-Identifier: Apache-2.0
"""Sums of pair forces by bottle, through a table of WIDTH slots per bottle (drawn in `pairs.py`).

A slot holds an index into the columns of pair forces. Slots are sorted by partner, and separate pairs contribute 0, so
a bottle's sum does not depend on the time of the last rebuild. Bottles of different sizes can have more than WIDTH
neighbours; their further entries are in a separate list.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import ForceSums
from conveyor_sim.engine.arrays.contacts import Slots
from conveyor_sim.engine.compiler.compile import fill, part

WIDTH = 6
"""Neighbours of equal bottles in a hexagonal packing."""

_1, _2, _3, _4, _5, _6 = uint64(1), uint64(2), uint64(3), uint64(4), uint64(5), uint64(6)


@part
def fill_slots(pairs: Any, slots: Any) -> int:
    """Fill the table from the pair list; return the number of entries beyond WIDTH, which may exceed their capacity."""
    if slots is None:
        return 0
    capacity, used = pairs.i.size, pairs.used[0]
    fill(slots.filled, 0)
    for p in range(used):
        slots.filled[pairs.i[p]] += 1
        slots.filled[pairs.j[p]] += 1
    total = 0
    for i in range(slots.filled.size):
        slots.more_start[i] = min(total, slots.more_entry.size)
        total += max(0, int(slots.filled[i]) - WIDTH)
    slots.more_start[slots.filled.size] = min(total, slots.more_entry.size)
    fill(slots.entry, 2 * capacity)
    fill(slots.filled, 0)
    # In the order of (i, j), pairs with a lower partner (bottle is j) precede pairs with a higher one (bottle is i).
    for p in range(used):
        _enter(slots, pairs.j[p], capacity + p)
        _enter(slots, pairs.i[p], p)
    return total


@part
def _enter(slots: Slots, bottle: int, entry: int) -> None:
    place = slots.filled[bottle]
    slots.filled[bottle] += 1
    if place < WIDTH:
        slots.entry[bottle * WIDTH + place] = entry
    elif slots.more_start[bottle] + place - WIDTH < slots.more_entry.size:
        slots.more_entry[slots.more_start[bottle] + place - WIDTH] = entry
        slots.more_bottle[slots.more_start[bottle] + place - WIDTH] = bottle


@part
def sum_pair_forces(pairs: Any, slots: Any, load: ForceSums, moments: Any, first: int, end: int) -> None:
    """Set `load` and, if bottles turn, `moments` of bottles first to end to the sum of their pair forces."""
    if pairs is None:
        _clear(load, moments, first, end)
        return
    _sum_forces(slots, pairs.fx, pairs.fy, pairs.moment, load.fx, load.fy, moments, first, end)
    _sum_normals(slots, pairs.normal, load.normal_sum, load.normal_max, first, end)


@part
def _clear(load: ForceSums, moments: Any, first: int, end: int) -> None:
    _set_zero(load.fx, first, end)
    _set_zero(load.fy, first, end)
    _set_zero(moments, first, end)
    _set_zero(load.normal_sum, first, end)
    _set_zero(load.normal_max, first, end)


@part
def _set_zero(column: Any, first: int, end: int) -> None:
    if column is not None:
        for i in range(first, end):
            column[i] = 0.0


@part
def _sum_forces(
    slots: Slots, pair_fx: Any, pair_fy: Any, pair_moment: Any, fx: Any, fy: Any, moments: Any, first: int, end: int
) -> None:
    entry = slots.entry
    for i in range(uint64(first), uint64(end)):
        row = i * _6
        a, b, c = entry[row], entry[row + _1], entry[row + _2]
        d, e, f = entry[row + _3], entry[row + _4], entry[row + _5]
        fx[i] = ((((pair_fx[a] + pair_fx[b]) + pair_fx[c]) + pair_fx[d]) + pair_fx[e]) + pair_fx[f]
        fy[i] = ((((pair_fy[a] + pair_fy[b]) + pair_fy[c]) + pair_fy[d]) + pair_fy[e]) + pair_fy[f]
        if moments is not None:
            moment = ((pair_moment[a] + pair_moment[b]) + pair_moment[c]) + pair_moment[d]
            moments[i] = (moment + pair_moment[e]) + pair_moment[f]
    for place in range(slots.more_start[first], slots.more_start[end]):
        i, a = slots.more_bottle[place], slots.more_entry[place]
        fx[i] += pair_fx[a]
        fy[i] += pair_fy[a]
        if moments is not None:
            moments[i] += pair_moment[a]


@part
def _sum_normals(slots: Slots, normals: Any, sums: Any, largest: Any, first: int, end: int) -> None:
    if normals is None:
        return
    for i in range(uint64(first), uint64(end)):
        total = 0.0
        most = 0.0
        for place in range(i * _6, i * _6 + _6):
            normal = normals[slots.entry[place]]
            total += normal
            most = normal if normal > most else most
        sums[i] = total
        largest[i] = most
    for place in range(slots.more_start[first], slots.more_start[end]):
        i, normal = slots.more_bottle[place], normals[slots.more_entry[place]]
        sums[i] += normal
        largest[i] = normal if normal > largest[i] else largest[i]


@part
def sum_slots(slots: Any, values: Any, first: int, end: int, sums: Any) -> None:
    """Set sums[i] of bottles first to end to the sum of their entries in any column of pair values."""
    if slots is None:
        _set_zero(sums, first, end)
        return
    for i in range(uint64(first), uint64(end)):
        total = 0.0
        for place in range(i * _6, i * _6 + _6):
            total += values[slots.entry[place]]
        sums[i] = total
    for place in range(slots.more_start[first], slots.more_start[end]):
        sums[slots.more_bottle[place]] += values[slots.more_entry[place]]

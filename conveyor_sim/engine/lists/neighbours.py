# SPDX-License-Identifier: Apache-2.0
"""Verlet list of bottle pairs that may touch; it holds until a bottle has moved by its way, or half the skin.

It is sorted by slot, so that sums over it, and hence the bits of a run, do not depend on the time of a rebuild.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.contacts import ContactLaw, Pairs
from conveyor_sim.engine.arrays.lists import Neighbourhood
from conveyor_sim.engine.arrays.types import I8, U4
from conveyor_sim.engine.compiler.compile import kernel, part, written
from conveyor_sim.engine.impulses.carry import store_pairs
from conveyor_sim.engine.lists.cells import bucket_of, number_of, sort_into_cells
from conveyor_sim.engine.lists.coarse import prepare_coarse
from conveyor_sim.engine.lists.ways import cells_around, skin_between


@part
def list_pairs(bottles: Bottles, hood: Neighbourhood, pairs: Any, cell: float, skin: float) -> int:
    """Fill the pair list, sorted by (i, j), i < j; return the number of pairs, which may exceed its capacity.

    Radii and tangential springs by pair are filled or transferred, too; `fill_laws` fills coefficients afterwards.
    """
    if pairs is None:
        return 0
    _copy_springs(pairs, pairs.spring)
    store_pairs(pairs, pairs.impulse)
    count, capacity = _find_pairs(bottles, hood, hood.coarse, pairs, cell, skin), pairs.i.size
    pairs.used[0] = min(count, capacity)
    _fill_radii(pairs, pairs.reach, bottles)
    if count <= capacity:
        _restore_springs(pairs, pairs.spring)
    return count


@part
def _find_pairs(bottles: Bottles, hood: Neighbourhood, coarse: Any, pairs: Pairs, cell: float, skin: float) -> int:
    """Write the pairs; return their number, which may exceed the capacity."""
    if _is_prepared(bottles, hood, coarse, cell, skin):
        return _filter_coarse(bottles, hood, coarse, pairs, skin)
    return _search_cells(bottles, hood, pairs, cell, skin)


@part
def _is_prepared(bottles: Bottles, hood: Neighbourhood, coarse: Any, cell: float, skin: float) -> bool:
    if coarse is None:
        return False
    return prepare_coarse(bottles, hood, coarse, hood.ways, cell, skin)


@part
def _search_cells(bottles: Bottles, hood: Neighbourhood, pairs: Pairs, cell: float, skin: float) -> int:
    """Find the pairs among bottles in cells around each."""
    sort_into_cells(bottles, hood, cell)
    rings = cells_around(hood.ways, cell, skin)
    buckets = hood.bucket.size - 1
    capacity, count = pairs.i.size, 0
    for i in range(bottles.x.size):
        if bottles.id[i] < 0:
            continue
        first = count
        for cx in range(hood.cell[i, 0] - rings, hood.cell[i, 0] + rings + 1):
            for cy in range(hood.cell[i, 1] - rings, hood.cell[i, 1] + rings + 1):
                b = bucket_of(cx, cy, buckets)
                number = number_of(cx, cy)
                for entry in range(uint64(hood.bucket[b]), uint64(hood.bucket[b + 1])):
                    j = hood.order[entry]
                    dx = hood.sorted_x[entry] - bottles.x[i]
                    dy = hood.sorted_y[entry] - bottles.y[i]
                    reach = bottles.radius[i] + hood.sorted_radius[entry] + skin_between(hood.ways, i, j, skin)
                    near = (dx * dx + dy * dy < reach * reach) & (hood.sorted_cell[entry] == number)
                    # Most candidates are none, in no order, so a branch on `near` would often be predicted wrongly. In
                    # a full list, a candidate must not replace the last pair.
                    if count < capacity:
                        pairs.j[count] = j
                    count += near & (j > i)
        _sort(pairs, i, first, min(count, capacity))
    return count


@part
def _filter_coarse(bottles: Bottles, hood: Neighbourhood, coarse: Any, pairs: Pairs, skin: float) -> int:
    """Take the pairs from the coarse list, and those of strays from their lists."""
    if coarse is None:
        return 0
    capacity, count = pairs.i.size, 0
    for i in range(uint64(bottles.x.size)):
        if bottles.id[i] < 0:
            continue
        first, x, y, radius = count, bottles.x[i], bottles.y[i], bottles.radius[i]
        if coarse.stray[i] == 0:
            for entry in range(uint64(coarse.start[i]), uint64(coarse.start[i + uint64(1)])):
                j = coarse.j[entry]
                dx = bottles.x[j] - x
                dy = bottles.y[j] - y
                reach = radius + bottles.radius[j] + skin_between(hood.ways, i, j, skin)
                if count < capacity:
                    pairs.i[count] = i
                    pairs.j[count] = j
                count += (dx * dx + dy * dy < reach * reach) & (coarse.stray[j] == 0)
        pair = coarse.last[i]
        if pair >= 0:
            while pair >= 0:
                if count < capacity:
                    pairs.j[count] = coarse.other[pair]
                count += 1
                pair = coarse.before[pair]
            _sort(pairs, i, first, min(count, capacity))
    return count


@part
def _sort(pairs: Pairs, i: int, first: int, end: int) -> None:
    """Sort the pairs of bottle i, which are first to end, by their second bottle."""
    for p in range(first, end):
        pairs.i[p] = i
        j, k = pairs.j[p], p
        while k > first and pairs.j[k - 1] > j:
            pairs.j[k] = pairs.j[k - 1]
            k -= 1
        pairs.j[k] = j


@kernel
def fill_column(column: Any, table: Any, pairs_i: U4, pairs_j: U4, used: I8, types: U4) -> None:
    """Fill a coefficient by pair from its table by types; both are None if no contact has that law."""
    if column is None:
        return
    count = round(table.size**0.5)
    for p in range(used[0]):
        column[p] = table[types[pairs_i[p]] * count + types[pairs_j[p]]]


_fill_columns: Any = written(
    "\n    ".join(
        [
            "def function(pairs, columns, tables, types):",
            *(
                f"fill(columns.{name}, tables.{name}, pairs.i, pairs.j, pairs.used, types)"
                for name in ContactLaw._fields
            ),
        ]
    ),
    fill=fill_column,
)


@part
def fill_laws(pairs: Any, law: Any, bottles: Bottles) -> None:
    """Fill the coefficients by pair of a rebuilt list; law: by type."""
    if pairs is not None:
        _fill_columns(pairs, pairs.law, law, bottles.type)


@part
def _fill_radii(pairs: Pairs, reach: Any, bottles: Bottles) -> None:
    if reach is None:
        return
    for p in range(pairs.used[0]):
        pairs.radius_i[p] = bottles.radius[pairs.i[p]]
        reach[p] = bottles.radius[pairs.i[p]] + bottles.radius[pairs.j[p]]


@part
def _copy_springs(pairs: Pairs, springs: Any) -> None:
    """Copy the springs by pair, unless a previous attempt with a shorter list has done so."""
    if springs is None:
        return
    if springs.kept_count[0] >= 0:
        return
    kept = 0
    for p in range(pairs.used[0]):
        if springs.elongation[p] != 0.0:
            springs.kept_i[kept] = pairs.i[p]
            springs.kept_j[kept] = pairs.j[p]
            springs.kept[kept] = springs.elongation[p]
            kept += 1
    springs.kept_count[0] = kept


@part
def _restore_springs(pairs: Pairs, springs: Any) -> None:
    """Restore the springs of pairs that are still listed; both lists are sorted by (i, j)."""
    if springs is None:
        return
    k, kept = 0, springs.kept_count[0]
    for p in range(pairs.used[0]):
        i, j = pairs.i[p], pairs.j[p]
        while k < kept and (springs.kept_i[k] < i or (springs.kept_i[k] == i and springs.kept_j[k] < j)):
            k += 1
        stored = k < kept and springs.kept_i[k] == i and springs.kept_j[k] == j
        springs.elongation[p] = springs.kept[k] if stored else 0.0
    springs.kept_count[0] = -1


@kernel
def drop_springs(pairs: Any, springs: Any, slot: int) -> None:
    """Reset the springs of a bottle that is removed: another bottle may get its slot before the next rebuild."""
    if springs is None:
        return
    for p in range(pairs.used[0]):
        if pairs.i[p] == slot or pairs.j[p] == slot:
            springs.elongation[p] = 0.0

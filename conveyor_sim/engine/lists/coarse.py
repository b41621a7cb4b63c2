# SPDX-License-Identifier: Apache-2.0
"""Coarse list of pairs, from which rebuilds take the pair list without a search of all cells.

It has all pairs within twice the skin, so it holds for all bottles whose movement since its search and whose way until
the next rebuild are no longer than the skin together. The others are strays: fast bottles, bottles that have moved
farther, and bottles that were put into slots since. Pairs with strays are searched in the cells. The pair list is the
same as after a search of all cells.
"""

import math

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import CoarseList, Neighbourhood, Ways
from conveyor_sim.engine.compiler.compile import copy, fill, part
from conveyor_sim.engine.lists.cells import bucket_of, number_of, sort_into_cells

WORTH = 2
"""Strays cost as much as a new search once their number, summed over rebuilds, exceeds the slots over WORTH.

Fast bottles do not count, because they are strays after a search, too.
"""


@part
def prepare_coarse(
    bottles: Bottles, hood: Neighbourhood, coarse: CoarseList, ways: Ways, cell: float, skin: float
) -> bool:
    """Search all pairs anew if that is due, then the pairs with strays. Return False if there is too little room.

    The cells are then those of no search. cell: edge for the pair list, m.
    """
    edge = cell + skin
    strays, fast = _find_strays(bottles, coarse, ways, skin)
    if coarse.spent[0] < 0 or WORTH * (coarse.spent[0] + strays - fast) > bottles.x.size:
        coarse.spent[0] = 0 if _search(bottles, hood, coarse, edge, 2.0 * skin) else -1
        if coarse.spent[0] < 0:
            return False
        strays, fast = _find_strays(bottles, coarse, ways, skin)
    coarse.spent[0] += strays - fast
    fill(coarse.last, -1)
    reach = cell - skin + max(skin, ways.most)
    slow = _search_strays(bottles, hood, coarse, ways, strays, 0, False, edge, cell, skin)
    count = _search_strays(bottles, hood, coarse, ways, strays, slow, True, edge, reach, skin)
    for place in range(strays):
        i = coarse.strays[place]
        coarse.cell_stray[bucket_of(hood.cell[i, 0], hood.cell[i, 1], hood.bucket.size - 1)] = -1
    if count > coarse.other.size:
        coarse.spent[0] = -1
    return coarse.spent[0] >= 0


@part
def _find_strays(bottles: Bottles, coarse: CoarseList, ways: Ways, skin: float) -> tuple[int, int]:
    """Mark strays and free slots, and list the strays. Return the number of strays, and that of fast ones."""
    for i in range(uint64(bottles.x.size)):
        dx = bottles.x[i] - coarse.x[i]
        dy = bottles.y[i] - coarse.y[i]
        left = skin - ways.way[i]
        # A failed tick may leave NaN here: such a bottle is a stray.
        stays = (left >= 0.0) & (dx * dx + dy * dy <= left * left)
        coarse.stray[i] = 1 - (stays & (bottles.radius[i] == coarse.radius[i]))
    strays, fast = 0, 0
    for i in range(bottles.x.size):
        if coarse.stray[i] != 0 and bottles.id[i] >= 0:
            coarse.strays[strays] = i
            strays += 1
            fast += ways.way[i] > skin
    return strays, fast


@part
def _search(bottles: Bottles, hood: Neighbourhood, coarse: CoarseList, edge: float, skin: float) -> bool:
    """List all pairs within the sum of radii and a skin. Return False if they do not fit."""
    sort_into_cells(bottles, hood, edge)
    copy(bottles.x, coarse.x)
    copy(bottles.y, coarse.y)
    buckets, capacity, count = hood.bucket.size - 1, coarse.j.size, 0
    for entry in range(hood.bucket[buckets]):
        coarse.number[entry] = hood.sorted_cell[entry]
    for i in range(bottles.x.size):
        coarse.start[i] = min(count, capacity)
        coarse.radius[i] = -1.0
        if bottles.id[i] < 0:
            continue
        coarse.radius[i] = bottles.radius[i]
        first = count
        for cx in range(hood.cell[i, 0] - 1, hood.cell[i, 0] + 2):
            for cy in range(hood.cell[i, 1] - 1, hood.cell[i, 1] + 2):
                b = bucket_of(cx, cy, buckets)
                number = number_of(cx, cy)
                for entry in range(uint64(hood.bucket[b]), uint64(hood.bucket[b + 1])):
                    j = hood.order[entry]
                    dx = hood.sorted_x[entry] - bottles.x[i]
                    dy = hood.sorted_y[entry] - bottles.y[i]
                    reach = bottles.radius[i] + hood.sorted_radius[entry] + skin
                    near = (dx * dx + dy * dy < reach * reach) & (hood.sorted_cell[entry] == number)
                    # Without a branch on `near`, as in `_search_cells`.
                    if count < capacity:
                        coarse.j[count] = j
                    count += near & (j > i)
        _sort(coarse, first, min(count, capacity))
    coarse.start[bottles.x.size] = min(count, capacity)
    return count <= capacity


@part
def _sort(coarse: CoarseList, first: int, end: int) -> None:
    for p in range(first + 1, end):
        j, k = coarse.j[p], p
        while k > first and coarse.j[k - 1] > j:
            coarse.j[k] = coarse.j[k - 1]
            k -= 1
        coarse.j[k] = j


@part
def _search_strays(
    bottles: Bottles,
    hood: Neighbourhood,
    coarse: CoarseList,
    ways: Ways,
    strays: int,
    count: int,
    fast: bool,
    edge: float,
    reach: float,
    skin: float,
) -> int:
    """List the pairs with strays by their first slots. Return their number, which may exceed the capacity.

    The cells hold the bottles where they were at the last search. Strays among them are left out there. Fast strays
    are searched after the others, so that the reach of each covers the ways of all before it. count: pairs so far.
    reach: largest sum of the radii and the way of the other bottle, m.
    """
    buckets, capacity = hood.bucket.size - 1, coarse.other.size
    for place in range(strays):
        i = coarse.strays[place]
        if (ways.way[i] > skin) != fast:
            continue
        x, y, far = bottles.x[i], bottles.y[i], reach + ways.way[i]
        for cx in range(math.floor((x - far) / edge), math.floor((x + far) / edge) + 1):
            for cy in range(math.floor((y - far) / edge), math.floor((y + far) / edge) + 1):
                b = bucket_of(cx, cy, buckets)
                number = number_of(cx, cy)
                for entry in range(uint64(hood.bucket[b]), uint64(hood.bucket[b + 1])):
                    j = hood.order[entry]
                    if coarse.stray[j] == 0 and coarse.number[entry] == number:
                        count = _pair_up(bottles, coarse, ways, i, j, count, capacity)
                # Strays before in the list.
                j = coarse.cell_stray[b]
                while j >= 0:
                    if hood.cell[j, 0] == cx and hood.cell[j, 1] == cy:
                        count = _pair_up(bottles, coarse, ways, i, j, count, capacity)
                    j = coarse.same_cell[j]
        hood.cell[i, 0] = math.floor(x / edge)
        hood.cell[i, 1] = math.floor(y / edge)
        b = bucket_of(hood.cell[i, 0], hood.cell[i, 1], buckets)
        coarse.same_cell[i] = coarse.cell_stray[b]
        coarse.cell_stray[b] = i
    return count


@part
def _pair_up(bottles: Bottles, coarse: CoarseList, ways: Ways, i: int, j: int, count: int, capacity: int) -> int:
    """Add the pair of i and j if it is near. Return the number of pairs with strays."""
    dx = bottles.x[j] - bottles.x[i]
    dy = bottles.y[j] - bottles.y[i]
    reach = bottles.radius[i] + bottles.radius[j] + ways.way[i] + ways.way[j]
    if dx * dx + dy * dy < reach * reach:
        if count < capacity:
            first = min(i, j)
            coarse.other[count] = max(i, j)
            coarse.before[count] = coarse.last[first]
            coarse.last[first] = count
        return count + 1
    return count

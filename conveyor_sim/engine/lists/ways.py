# SPDX-License-Identifier: Apache-2.0
"""Ways of bottles until the next rebuild, with integrator impulses: the faster a bottle is, the farther it may move.

Lists of slow bottles in a queue stay short, and fast bottles, which have few neighbours, seldom need a rebuild. With
other integrators, each bottle may move by half of the skin.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import Ways
from conveyor_sim.engine.compiler.compile import part


@part
def plan_ways(bottles: Bottles, ways: Any) -> None:
    """Set the way of each bottle by its present speed, at a rebuild."""
    if ways is not None:
        _plan(bottles, ways)


@part
def _plan(bottles: Bottles, ways: Ways) -> None:
    for i in range(uint64(bottles.x.size)):
        speed = math.sqrt(bottles.vx[i] * bottles.vx[i] + bottles.vy[i] * bottles.vy[i])
        way = ways.least + ways.time * speed
        # A failed tick may leave NaN here.
        ways.way[i] = way if way < ways.most else ways.most


@part
def margin_of(ways: Any, i: int, margin: float) -> float:
    """Return the way of bottle i, m; `margin` without ways."""
    if ways is None:
        return margin
    return ways.way[i]


@part
def skin_between(ways: Any, i: int, j: int, skin: float) -> float:
    """Return the sum of the ways of bottles i and j, m; `skin` without ways."""
    if ways is None:
        return skin
    return ways.way[i] + ways.way[j]


@part
def cells_around(ways: Any, cell: float, skin: float) -> int:
    """Return the number of rings of cells around a bottle's cell that hold its neighbours. cell: edge, m."""
    if ways is None:
        return 1
    return math.ceil((cell - skin + 2.0 * ways.most) / cell)


@part
def may_leave(bottles: Bottles, hood: Any, h: float, first: int, end: int) -> bool:
    """Return True if a bottle of first to end may exceed its way in the next substep of h seconds.

    Contacts are solved before the bottles touch, so the lists must hold for the way of a substep more.
    """
    way, far = hood.ways.way, 0
    for i in range(uint64(first), uint64(end)):
        dx = abs(bottles.x[i] - hood.x[i]) + h * abs(bottles.vx[i])
        dy = abs(bottles.y[i] - hood.y[i]) + h * abs(bottles.vy[i])
        far |= dx * dx + dy * dy > way[i] * way[i]
    return far != 0

# SPDX-License-Identifier: Apache-2.0
"""The belt that carries a bottle: the last listed one under its axis, else the floor (paper eqs. 11-15)."""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.support import Belts
from conveyor_sim.engine.arrays.types import I4
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.lists.near import end_list
from conveyor_sim.engine.lists.ways import margin_of
from conveyor_sim.engine.support.sector import span_distance
from conveyor_sim.engine.threads.workers import UNIT


@part
def belt_distance(belts: Belts, sectors: Any, h: int, x: float, y: float) -> float:
    """Return a signed distance (m) to the edge of belt h, >= 0 on the belt; its magnitude is a lower bound."""
    if sectors is not None:
        if sectors.reach[h] >= 0:  # a test for None is pruned only if it stands alone
            return _sector_distance(sectors, h, x, y)
    dx = x - belts.x[h]
    dy = y - belts.y[h]
    xi = dx * belts.ax[h] + dy * belts.ay[h]
    eta = dy * belts.ax[h] - dx * belts.ay[h]
    along = min(xi, belts.length[h] - xi)
    across = min(eta, belts.width[h] - eta)
    return min(along, across)


@part
def _sector_distance(sectors: Any, h: int, x: float, y: float) -> float:
    dx = x - sectors.x[h]
    dy = y - sectors.y[h]
    radius = math.sqrt(dx * dx + dy * dy)
    radial = min(radius - sectors.inner[h], sectors.outer[h] - radius)
    angular = span_distance(
        dx, dy, sectors.start_x[h], sectors.start_y[h], sectors.end_x[h], sectors.end_y[h], sectors.reach[h]
    )
    return min(radial, angular)


@part
def carrier(i: int, belts: Any, floor: int, x: float, y: float) -> int:
    """Return the belt under the axis of bottle i, or `floor`; candidates were listed at the last rebuild."""
    if belts is None:
        return floor
    certain = belts.certain[i]
    if certain >= 0:
        return certain
    for entry in range(belts.start[i], belts.start[i + 1]):
        h = belts.candidate[entry]
        if belt_distance(belts, belts.sectors, h, x, y) >= 0.0:
            return h
    return floor


@part
def surface_velocity(h: int, x: float, y: float, surface: Any, turn: Any) -> tuple[float, float]:
    """Return the velocity of surface h at a point, m/s: uniform on a straight belt, Omega x (r - C) on a curved one."""
    ux, uy = surface.ux[h], surface.uy[h]
    if turn is not None:
        ux -= turn[h] * y
        uy += turn[h] * x
    return ux, uy


@part
def list_belts(
    bottles: Bottles, grid: Any, homes: I4, belts: Any, ring: Any, floor: int, ways: Any, margin: float
) -> int:
    """Store the belt that covers a base and the way around it, or list candidates. Return their number.

    margin: way, in m, where `ways` is None.
    """
    if belts is None:
        return 0
    count = 0
    uncertain = 0
    for i in range(bottles.x.size):
        if i % UNIT == 0:
            belts.uncertain.first[i // UNIT] = uncertain
        belts.start[i] = min(count, belts.candidate.size)
        belts.certain[i] = floor
        if homes[i] >= 0:
            around = margin_of(ways, i, margin) + _base_radius(ring, i)
            count = _list_candidates(i, bottles, grid, homes[i], belts, around, count)
        if belts.certain[i] < 0:
            belts.uncertain.bottle[uncertain] = i
            uncertain += 1
    belts.start[bottles.x.size] = min(count, belts.candidate.size)
    end_list(belts.uncertain, bottles.x.size, uncertain)
    return count


@part
def _base_radius(ring: Any, i: int) -> float:
    if ring is None:
        return 0.0
    return ring.radius[i]


@part
def _list_candidates(i: int, bottles: Bottles, grid: Any, home: int, belts: Belts, margin: float, count: int) -> int:
    first = count
    # The last listed belt carries: the grid lists them in that order.
    for entry in range(grid.belt_start[home], grid.belt_start[home + 1]):
        h = grid.belt[entry]
        distance = belt_distance(belts, belts.sectors, h, bottles.x[i], bottles.y[i])
        if distance <= -margin:
            continue
        if distance >= margin and count == first:
            belts.certain[i] = h
            return count
        belts.certain[i] = -1
        if count < belts.candidate.size:
            belts.candidate[count] = h
        count += 1
        if distance >= margin:
            return count
    return count

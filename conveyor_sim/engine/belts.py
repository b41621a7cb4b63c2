"""Which belt carries a bottle: the last listed one under its axis, else the floor (paper eqs. 11-15)."""

import math
from typing import Any

from .arrays import Belts
from .compile import kernel
from .sector import span_distance


@kernel
def belt_distance(belts: Belts, sectors: Any, h: int, x: float, y: float) -> float:
    """Signed distance in m of a point from the edge of belt h: >= 0 on it, never more in size than the true one."""
    if sectors is not None:
        if sectors.reach[h] >= 0:  # a test for None is pruned where it stands alone
            return _sector_distance(sectors, h, x, y)
    dx = x - belts.x[h]
    dy = y - belts.y[h]
    xi = dx * belts.ax[h] + dy * belts.ay[h]
    eta = dy * belts.ax[h] - dx * belts.ay[h]
    along = min(xi, belts.length[h] - xi)
    across = min(eta, belts.width[h] - eta)
    return min(along, across)


@kernel
def _sector_distance(sectors: Any, h: int, x: float, y: float) -> float:
    dx = x - sectors.x[h]
    dy = y - sectors.y[h]
    radius = math.sqrt(dx * dx + dy * dy)
    radial = min(radius - sectors.inner[h], sectors.outer[h] - radius)
    angular = span_distance(
        dx, dy, sectors.start_x[h], sectors.start_y[h], sectors.end_x[h], sectors.end_y[h], sectors.reach[h]
    )
    return min(radial, angular)


@kernel
def carrier(i: int, belts: Any, floor: int, x: float, y: float) -> int:
    """The belt under the axis of bottle i, or `floor`; candidates were listed at the last rebuild."""
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

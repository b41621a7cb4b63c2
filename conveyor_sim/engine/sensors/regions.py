# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes are in regions, which are simple polygons."""

from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.lists.static_grid import cell_at


@kernel
def list_inside(
    grid: StaticGrid,
    boxes: F8,
    corners: F8,
    start: I8,
    x: F8,
    y: F8,
    ids: I8,
    pairs: I8,
    first: I8,
    inside: I8,
) -> int:
    """List the bottles with their axes in each region; return their number, which may exceed the capacity.

    boxes: (R, 4), m, in the cells of `grid` as bodies. Region r has the corners [start[r]:start[r + 1]], m, and the
    bottles inside[first[r]:first[r + 1]], slots in order; inside: (n,), first: (R + 1,). pairs: scratch, (2, n).
    """
    for region in range(first.size):
        first[region] = 0
    count, capacity = 0, inside.size
    for i in range(x.size):
        home = cell_at(grid, x[i], y[i]) if ids[i] >= 0 else -1
        if home < 0:
            continue
        for entry in range(grid.body_start[home], grid.body_start[home + 1]):
            region = grid.body[entry]
            if not (boxes[region, 0] <= x[i] <= boxes[region, 2] and boxes[region, 1] <= y[i] <= boxes[region, 3]):
                continue
            if _is_inside(corners, start[region], start[region + 1], x[i], y[i]):
                if count < capacity:
                    pairs[0, count], pairs[1, count] = region, i
                    first[region + 1] += 1
                count += 1
    if count > capacity:
        return count
    for region in range(1, first.size):
        first[region] += first[region - 1]
    # Backwards: each entry of `first` but the last ends as the start of its region.
    for pair in range(count - 1, -1, -1):
        region = pairs[0, pair]
        first[region + 1] -= 1
        inside[first[region + 1]] = pairs[1, pair]
    for region in range(first.size - 1):
        first[region] = first[region + 1]
    first[first.size - 1] = count
    return count


@part
def _is_inside(corners: F8, first: int, end: int, x: float, y: float) -> bool:
    """Return True if a ray from a point to the right crosses an odd number of edges of a polygon."""
    inside = False
    x1, y1 = corners[end - 1]
    for corner in range(first, end):
        x2, y2 = corners[corner]
        if y1 != y2 and (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
            inside = not inside
        x1, y1 = x2, y2
    return inside

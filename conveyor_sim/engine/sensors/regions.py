# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes are in regions: first those in the box of each region, in one pass, then those in its polygon."""

from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.lists.static_grid import cell_at


@kernel
def list_near(grid: StaticGrid, boxes: F8, x: F8, y: F8, ids: I8, pairs: I8, first: I8, near: I8) -> int:
    """List the bottles with their axes in the box of each region; return their number, which may exceed the capacity.

    boxes: (R, 4), m, in the cells of `grid` as bodies. Region r has near[first[r]:first[r + 1]], slots in order; near:
    (n,), first: (R + 1,). pairs: scratch, (2, n).
    """
    for region in range(first.size):
        first[region] = 0
    count, capacity = 0, near.size
    for i in range(x.size):
        home = cell_at(grid, x[i], y[i]) if ids[i] >= 0 else -1
        if home < 0:
            continue
        for entry in range(grid.body_start[home], grid.body_start[home + 1]):
            region = grid.body[entry]
            if boxes[region, 0] <= x[i] <= boxes[region, 2] and boxes[region, 1] <= y[i] <= boxes[region, 3]:
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
        near[first[region + 1]] = pairs[1, pair]
    for region in range(first.size - 1):
        first[region] = first[region + 1]
    first[first.size - 1] = count
    return count


@kernel
def find_inside(corners: F8, x: F8, y: F8, ids: I8, near: I8, first: int, end: int, slots: I8) -> int:
    """Return the number of bottles in a simple polygon (n, 2), m; write their slots, in order, to `slots`.

    Bottles near[first:end] are tried. A bottle is inside if a ray to the right crosses an odd number of edges.
    """
    count = 0
    for place in range(first, end):
        i = near[place]
        if ids[i] < 0:
            continue
        inside = False
        for corner in range(corners.shape[0]):
            x1, y1 = corners[corner]
            x2, y2 = corners[(corner + 1) % corners.shape[0]]
            if y1 != y2 and (y1 > y[i]) != (y2 > y[i]) and x[i] < x1 + (y[i] - y1) * (x2 - x1) / (y2 - y1):
                inside = not inside
        if inside:
            slots[count] = i
            count += 1
    return count

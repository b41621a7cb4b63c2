# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes are in a region."""

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel, part

ROUNDING = 1e-9
"""Larger than the rounding error of a point on an edge, m."""


@kernel
def find_inside(corners: F8, x: F8, y: F8, ids: I8, slots: I8) -> int:
    """Return the number of bottles in a simple polygon (n, 2), m; write their slots, in order, to `slots`, (slots,).

    A bottle is inside if a ray to the right crosses an odd number of edges.
    """
    left, right = _range(corners[:, 0])
    low, high = _range(corners[:, 1])
    count = 0
    for i in range(x.size):
        # Almost all bottles of a long line are outside the box of the polygon.
        if x[i] < left or x[i] > right or y[i] < low or y[i] > high or ids[i] < 0:
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


@part
def _range(coordinates: F8) -> tuple[float, float]:
    """Return the limits of the corners, with a margin for rounding."""
    low = high = coordinates[0]
    for coordinate in coordinates:
        low, high = min(low, coordinate), max(high, coordinate)
    return low - ROUNDING, high + ROUNDING

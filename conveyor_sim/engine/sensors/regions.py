# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes are in a region."""

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel

ROUNDING = 1e-9
"""Margin of the box around a polygon, m, because the places where edges are crossed are rounded."""


@kernel
def find_inside(corners: F8, x: F8, y: F8, ids: I8, slots: I8) -> int:
    """Return the number of bottles in a simple polygon (n, 2), m; write their slots, in order, to `slots`, (slots,).

    A bottle is inside if a ray to the right crosses an odd number of edges.
    """
    count = 0
    left, right, low, high = corners[0, 0], corners[0, 0], corners[0, 1], corners[0, 1]
    for corner in range(corners.shape[0]):
        left, right = min(left, corners[corner, 0] - ROUNDING), max(right, corners[corner, 0] + ROUNDING)
        low, high = min(low, corners[corner, 1]), max(high, corners[corner, 1])
    for i in range(x.size):
        if ids[i] < 0 or not (left <= x[i] <= right and low <= y[i] <= high):
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

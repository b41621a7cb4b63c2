# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes cross a line within a tick, with the time of each."""

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel, part

ROUNDING = 1e-9
"""Larger than the rounding error of a crossing, m."""


@kernel
def find_crossings(before: F8, x: F8, y: F8, ids: I8, lines: F8, crossed: I8, share: F8) -> int:
    """Return how often axes crossed lines on the straight paths from their previous positions, (2, slots), m.

    lines: start, vector (m), and the vector's square, (L, 5). Written per crossing: line, slot, and 1 from the line's
    left to its right, (3, n); the share of the tick before it, (n,). n is L times the slots.

    Bottles come and go between ticks only, so each slot has the same bottle at both places.
    """
    count = 0
    for line in range(lines.shape[0]):
        left, right = _range(lines[line, 0], lines[line, 2])
        low, high = _range(lines[line, 1], lines[line, 3])
        for i in range(ids.size):
            # Almost all bottles of a long line are outside the box of the line.
            if max(x[i], before[0, i]) < left or min(x[i], before[0, i]) > right or ids[i] < 0:
                continue
            if max(y[i], before[1, i]) < low or min(y[i], before[1, i]) > high:
                continue
            side_before, along_before = _seen(lines, line, before[0, i], before[1, i])
            side, along = _seen(lines, line, x[i], y[i])
            if (side_before > 0.0) == (side > 0.0):
                continue
            at = side_before / (side_before - side)
            if 0.0 <= along_before + at * (along - along_before) <= 1.0:
                crossed[0, count], crossed[1, count], crossed[2, count] = line, i, side_before > 0.0
                share[count] = at
                count += 1
    return count


@part
def _range(start: float, extent: float) -> tuple[float, float]:
    """Return the limits of a coordinate along a line."""
    return min(start, start + extent) - ROUNDING, max(start, start + extent) + ROUNDING


@part
def _seen(lines: F8, line: int, x: float, y: float) -> tuple[float, float]:
    """Return how far a point is to the left of a line (in its lengths), and how far along it (0 to 1)."""
    dx, dy, ex, ey = x - lines[line, 0], y - lines[line, 1], lines[line, 2], lines[line, 3]
    return (ex * dy - ey * dx) / lines[line, 4], (ex * dx + ey * dy) / lines[line, 4]

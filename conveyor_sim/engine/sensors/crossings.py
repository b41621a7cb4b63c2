# SPDX-License-Identifier: Apache-2.0
"""Bottles whose axes cross a line within a tick, with the time of each."""

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.compile import kernel, part


@kernel
def find_crossings(
    before: F8, ids_before: I8, x: F8, y: F8, ids: I8, line: F8, slots: I8, share: F8, forward: I8
) -> int:
    """Return the number of axes that crossed a line on the straight path from their previous positions, (2, slots), m.

    line: its start, its vector, m, and the vector's square: (5,). Written, (slots,): the slots that crossed, the share
    of the tick at which they did, and 1 for those that went from the line's left to its right.
    """
    count = 0
    for i in range(ids_before.size):
        if ids_before[i] < 0 or ids[i] != ids_before[i]:
            continue
        left_before, along_before = _seen(line, before[0, i], before[1, i])
        left, along = _seen(line, x[i], y[i])
        if (left_before > 0.0) == (left > 0.0):
            continue
        at = left_before / (left_before - left)
        if 0.0 <= along_before + at * (along - along_before) <= 1.0:
            slots[count], share[count], forward[count] = i, at, left_before > 0.0
            count += 1
    return count


@part
def _seen(line: F8, x: float, y: float) -> tuple[float, float]:
    """Return how far a point is to the left of a line (in its lengths), and how far along it (0 to 1)."""
    dx, dy = x - line[0], y - line[1]
    return (line[2] * dy - line[3] * dx) / line[4], (line[2] * dx + line[3] * dy) / line[4]

# SPDX-License-Identifier: Apache-2.0
"""Joints of rail pieces. Their common end point pushes a bottle once, and only a bottle that lies beyond the ends of
both pieces.
"""

from conveyor_sim.engine.arrays.rails import Ends
from conveyor_sim.engine.compiler.compile import part

FREE, ANSWERS, SILENT = 0, 1, 2


@part
def end_counts(ends: Ends, piece: int, end: int, x: float, y: float) -> bool:
    """Return True if the end point of a piece may touch a bottle at (x, y) that lies beyond that end.

    A free end may. At a joint the point is nearest to the bottle only if the bottle lies beyond the neighbour's end,
    too. Otherwise the neighbour's side touches, and a contact with the point would be spurious. One of the two pieces
    is responsible for the point.
    """
    joint = ends.joint[piece, end]
    if joint == FREE:
        return True
    if joint == SILENT:
        return False
    dx = x - ends.x[piece, end]
    dy = y - ends.y[piece, end]
    return dx * ends.neighbour_x[piece, end] + dy * ends.neighbour_y[piece, end] <= 0.0

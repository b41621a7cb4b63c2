"""Where rail pieces meet: their common end point pushes a bottle once, and only from beyond both pieces."""

from conveyor_sim.engine.arrays.rails import Ends
from conveyor_sim.engine.compiler.compile import part

FREE, ANSWERS, SILENT = 0, 1, 2


@part
def end_counts(ends: Ends, piece: int, end: int, x: float, y: float) -> bool:
    """Whether the end point of a piece may touch a bottle at (x, y) that lies beyond that end.

    A free end may. At a joint the point is nearest to the bottle only if it lies beyond the neighbour's end too; else
    the neighbour's own side touches, and the point would be a ghost. One of the two pieces answers for the point.
    """
    joint = ends.joint[piece, end]
    if joint == FREE:
        return True
    if joint == SILENT:
        return False
    dx = x - ends.x[piece, end]
    dy = y - ends.y[piece, end]
    return dx * ends.neighbour_x[piece, end] + dy * ends.neighbour_y[piece, end] <= 0.0

# SPDX-License-Identifier: Apache-2.0
"""A bottle and a straight rail piece: nearest point of the segment, end points included."""

import math

from conveyor_sim.engine.arrays.rails import Segments
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.rails.joint import end_counts


@part
def segment_contact(segments: Segments, g: int, x: float, y: float, radius: float) -> tuple[float, float, float]:
    """Return the overlap (m) of a circle with segment g, and the unit normal from its centre to it; 0 or less: none."""
    dx = x - segments.x[g]
    dy = y - segments.y[g]
    tx, ty = segments.tx[g], segments.ty[g]
    along = dx * tx + dy * ty
    if 0.0 < along < segments.length[g]:
        side = tx * dy - ty * dx
        # A centre exactly on the rail is pushed to the left of it.
        sign = 1.0 if side >= 0.0 else -1.0
        return radius - abs(side), sign * ty, -sign * tx
    end = 0 if along <= 0.0 else 1
    if not end_counts(segments.ends, g, end, x, y):
        return 0.0, 0.0, 0.0
    dx = segments.ends.x[g, end] - x
    dy = segments.ends.y[g, end] - y
    squared = dx * dx + dy * dy
    if squared >= radius * radius:
        return 0.0, 0.0, 0.0
    distance = math.sqrt(squared)
    if distance == 0.0:
        return radius, -tx if end == 1 else tx, -ty if end == 1 else ty
    return radius - distance, dx / distance, dy / distance

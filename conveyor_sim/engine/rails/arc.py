# SPDX-License-Identifier: Apache-2.0
"""A bottle and an arc rail: nearest point of the arc, end points included."""

import math

from conveyor_sim.engine.arrays.rails import Arcs
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.rails.joint import end_counts
from conveyor_sim.engine.support.sector import span_distance


@part
def arc_contact(arcs: Arcs, k: int, x: float, y: float, radius: float) -> tuple[float, float, float]:
    """Return the overlap (m) of a circle with arc k, and the unit normal from its centre to it; 0 or less: none."""
    dx = x - arcs.x[k]
    dy = y - arcs.y[k]
    squared = dx * dx + dy * dy
    curve = arcs.radius[k]
    outer = curve + radius
    if squared >= outer * outer:
        return 0.0, 0.0, 0.0
    distance = math.sqrt(squared)
    inside = span_distance(dx, dy, arcs.start_x[k], arcs.start_y[k], arcs.end_x[k], arcs.end_y[k], arcs.reach[k])
    if inside >= 0.0 and distance > 0.0:
        if distance >= curve:
            return radius - (distance - curve), -dx / distance, -dy / distance
        return radius - (curve - distance), dx / distance, dy / distance
    to_start_x, to_start_y = arcs.ends.x[k, 0] - x, arcs.ends.y[k, 0] - y
    to_end_x, to_end_y = arcs.ends.x[k, 1] - x, arcs.ends.y[k, 1] - y
    to_start = to_start_x * to_start_x + to_start_y * to_start_y
    to_end = to_end_x * to_end_x + to_end_y * to_end_y
    end = 0 if to_start <= to_end else 1
    if not end_counts(arcs.ends, k, end, x, y):
        return 0.0, 0.0, 0.0
    distance = math.sqrt(to_start if end == 0 else to_end)
    if distance == 0.0:
        # A centre exactly on the end is pushed off along the arc's radius.
        return (
            radius,
            -arcs.start_x[k] if end == 0 else -arcs.end_x[k],
            -arcs.start_y[k] if end == 0 else -arcs.end_y[k],
        )
    if end == 0:
        return radius - distance, to_start_x / distance, to_start_y / distance
    return radius - distance, to_end_x / distance, to_end_y / distance

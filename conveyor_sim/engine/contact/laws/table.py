# SPDX-License-Identifier: Apache-2.0
"""Normal force from a table of overlap and force, for contacts whose law was measured or computed elsewhere.

The force is linear between the points; the last slope continues. A table has at least two points, the first of them (0,
0).
"""

import math
from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.contact.laws.declaration import ElasticLaw
from conveyor_sim.engine.contact.laws.linear import contact_time


def force(c: int, depth: float, curves: Any) -> float:
    """Return the force of curve c in N at an overlap in m; 0 for c = -1 and without contact."""
    if c < 0 or depth <= 0.0:
        return 0.0
    low, high = curves.start[c], curves.start[c + 1] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if curves.overlap[middle] <= depth:
            low = middle
        else:
            high = middle
    slope = (curves.force[high] - curves.force[low]) / (curves.overlap[high] - curves.overlap[low])
    return curves.force[low] + slope * (depth - curves.overlap[low])


def energy(c: int, depth: float, curves: Any) -> float:
    """Return the area (J) under curve c up to an overlap in m; 0 for c = -1 and without contact."""
    if c < 0 or depth <= 0.0:
        return 0.0
    area = 0.0
    for point in range(curves.start[c], curves.start[c + 1] - 1):
        width = curves.overlap[point + 1] - curves.overlap[point]
        slope = (curves.force[point + 1] - curves.force[point]) / width
        last = point == curves.start[c + 1] - 2
        into = depth - curves.overlap[point]
        if into > width and not last:
            into = width
        if into > 0.0:
            area += (curves.force[point] + 0.5 * slope * into) * into
    return area


def points_of(c: int, curves: Any) -> tuple[F8, F8]:
    """Return overlaps (m) and forces (N) of curve c."""
    points = slice(int(curves.start[c]), int(curves.start[c + 1]))
    return curves.overlap[points], curves.force[points]


def deepest(c: int, stored: float, curves: Any) -> tuple[float, float]:
    """Return the overlap (m) and force (N) at an energy in J."""
    overlap, known = points_of(c, curves)
    steps = np.diff(overlap)
    areas = np.concatenate([[0.0], np.cumsum(0.5 * (known[1:] + known[:-1]) * steps)])
    piece = min(int(np.searchsorted(areas, stored, side="right")) - 1, len(steps) - 1)
    slope = float((known[piece + 1] - known[piece]) / steps[piece])
    left, start = stored - float(areas[piece]), float(known[piece])
    # start d + slope d^2 / 2 = left, solved without a division by the slope, which may be 0.
    deeper = 2.0 * left / (start + math.sqrt(start * start + 2.0 * slope * left))
    return float(overlap[piece]) + deeper, start + slope * deeper


def overlap_at(c: int, pressed: float, curves: Any) -> float:
    """Return the overlap (m) at a force in N; inf if the table never reaches it."""
    overlap, known = points_of(c, curves)
    if pressed > known[-1]:
        slope = float((known[-1] - known[-2]) / (overlap[-1] - overlap[-2]))
        return float(overlap[-1]) + (pressed - float(known[-1])) / slope if slope > 0.0 else math.inf
    return float(np.interp(pressed, known, overlap))


def stiffest(c: int, depth: float, curves: Any) -> float:
    """Return the largest slope of curve c at any overlap, N/m."""
    overlap, known = points_of(c, curves)
    return float(((known[1:] - known[:-1]) / (overlap[1:] - overlap[:-1])).max())


TABLE = ElasticLaw(
    name="table",
    field="table",
    column="curve",
    words="table",
    force=force,
    energy=energy,
    deepest=deepest,
    overlap_at=overlap_at,
    stiffest=stiffest,
    duration=lambda c, reduced_mass, speed, curves: contact_time(stiffest(c, 0.0, curves), reduced_mass),
    coefficient_text=lambda c, curves: f"on the table of {len(points_of(c, curves)[0])} points at",
    none=-1.0,
)

# SPDX-License-Identifier: Apache-2.0
"""The Pareto front of a work-precision diagram: settings that no other beats in both cost and error."""

from __future__ import annotations

import math
from collections.abc import Iterable

from conveyor_sim.accuracy.results import Point


def front(points: Iterable[Point], softened: bool = True) -> list[Point]:
    """Return the non-dominated points, the cheapest first.

    Cost is the median processor time, error the larger of those in impacts and in resting load. Failures and settings
    beyond a bound of stability are left out, and so are settings of another stiffness than the scene's if `softened` is
    false.
    """
    of_forces = [p for p in points if p.setting.sweeps is None]
    allowed = [p for p in of_forces if p.stable and (softened or p.setting.stiffness == 1.0)]
    placed = [(place, p) for p in allowed if (place := place_of(p))]
    chosen: list[tuple[tuple[float, float], Point]] = []
    for place, point in sorted(placed, key=lambda pair: pair[0]):
        if not chosen or place[1] < chosen[-1][0][1] or place == chosen[-1][0]:
            chosen.append((place, point))
    return [point for _, point in chosen]


def place_of(point: Point) -> tuple[float, float] | None:
    """Cost (s per simulated second) and the larger relative error; None of a setting that has no place there."""
    if point.failure or point.cost is None or point.errors is None:
        return None
    place = point.cost.median, point.worst
    return place if all(math.isfinite(value) for value in place) else None

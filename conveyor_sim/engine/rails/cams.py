# SPDX-License-Identifier: Apache-2.0
"""Displacement of bodies as a function of their axis: piecewise quadratic cams, and motion that repeats."""

import math
from typing import Any

from conveyor_sim.engine.arrays.moving import CamMotion, CamTable
from conveyor_sim.engine.compiler.compile import part


@part
def is_present(cams: Any, b: int) -> bool:
    """Return True if body b is in the range of its cam."""
    if cams is None:
        return True
    return cams.present[b] != 0


@part
def find_displacement(cams: CamMotion, b: int, coordinate: float) -> float:
    """Return the displacement of body b, m or rad; store its derivative and its displacement aside."""
    if cams.period[b] > 0.0:
        coordinate -= cams.period[b] * math.floor(coordinate / cams.period[b])
    cams.present[b], cams.rate[b] = 1, 1.0
    cams.aside[b] = cams.aside_rate[b] = 0.0
    table, cam, second = cams.table, cams.cam[b], cams.second[b]
    if cam < 0:
        return coordinate
    if not table.u[table.first[cam]] <= coordinate <= table.end[cam]:
        cams.present[b], cams.rate[b] = 0, 0.0
        return 0.0
    displacement, cams.rate[b] = _at(table, cam, coordinate)
    if second >= 0:
        cams.aside[b], cams.aside_rate[b] = _at(table, second, coordinate)
    return displacement


@part
def rates_at(cams: CamMotion, b: int, coordinate: float) -> tuple[float, float]:
    """Return the derivatives of the displacements of body b, along and aside, at a coordinate near the present one.

    Beyond the range of its cam they are the present ones.
    """
    if cams.period[b] > 0.0:
        coordinate -= cams.period[b] * math.floor(coordinate / cams.period[b])
    table, cam, second = cams.table, cams.cam[b], cams.second[b]
    if cam < 0 or not table.u[table.first[cam]] <= coordinate <= table.end[cam]:
        return cams.rate[b], cams.aside_rate[b]
    _, rate = _at(table, cam, coordinate)
    if second < 0:
        return rate, 0.0
    _, aside_rate = _at(table, second, coordinate)
    return rate, aside_rate


@part
def _at(table: CamTable, cam: int, u: float) -> tuple[float, float]:
    """Return displacement and slope of a cam at a coordinate."""
    p = table.first[cam]
    while p + 1 < table.first[cam + 1] and table.u[p + 1] <= u:
        p += 1
    since = u - table.u[p]
    slope = table.slope[p] + table.curvature[p] * since
    return table.s[p] + (table.slope[p] + 0.5 * table.curvature[p] * since) * since, slope

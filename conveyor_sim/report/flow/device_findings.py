# SPDX-License-Identifier: Apache-2.0
"""Findings about devices: on no belt, or against the direction of travel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.report.flow.finding import Finding, at
from conveyor_sim.report.flow.surfaces import NONE, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.geometry import Array
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.device_part import Exit, Giver
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.photo_eye import PhotoEye
from conveyor_sim.scene.parts.zone import Zone
from conveyor_sim.scene.polygons import inside
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import XY

SAMPLES = 41
"""Points along a line, and along each side of a region, that are compared with the belts."""

OPPOSED = -0.5
"""Largest cosine between a bottle's first direction and that of its belt at which they oppose each other."""


def devices_beside(scene: Scene, surfaces: SurfaceMap) -> Iterator[Finding]:
    """Yield a finding for each device that stands on no belt. Scenes without belts have none."""
    if not surfaces:
        return
    for path, part in scene.devices():
        for points in _footprints(part):
            if (surfaces.under(points) == NONE).all():
                middle = points.mean(axis=0)
                yield Finding(path, f"stands on no belt: none is at {at((middle[0], middle[1]))}")
                break
    reach = max(kind.radius for kind in scene.bottle_types.values())
    for place_of, mover in movers_of(scene):
        bodies, axis = mover_shape(place_of, mover)
        places = (0.0, 0.5 * axis.stroke, axis.stroke)
        ends = [_line(*piece.ends) for place in places for body in bodies for piece in body.at(place)]
        if not _near(surfaces, np.vstack(ends), reach):
            middle = ends[0].mean(axis=0)
            yield Finding(place_of, f"stands beside all belts: none is at {at((middle[0], middle[1]))}")


def devices_reversed(scene: Scene, surfaces: SurfaceMap, legs: Sequence[Leg]) -> Iterator[Finding]:
    """Yield a finding for each counter, inspection and entry against the direction of travel."""
    for path, part in scene.devices():
        if isinstance(part, (Counter, Inspection)):
            travel = _travel(part.from_, part.to, surfaces, legs)
            forward = np.array([part.to[1] - part.from_[1], part.from_[0] - part.to[0]])
            if travel is not None and float(forward @ travel) < 0.0:
                text = "drawn against the direction of travel: bottles pass it backward; exchange `from` and `to`"
                yield Finding(path, text)
        elif isinstance(part, Giver) and part.heading[1] > 0.0:
            yield from _entry_reversed(path, part, surfaces)


def _entry_reversed(path: Path, part: Giver, surfaces: SurfaceMap) -> Iterator[Finding]:
    place = np.array([part.position])
    carrier = int(surfaces.under(place)[0])
    if carrier == NONE:
        return
    direction = np.array([math.cos(part.heading[0]), math.sin(part.heading[0])])
    if float(surfaces[carrier].heading(place)[0] @ direction) < OPPOSED:
        yield Finding((*path, "direction"), f"against the direction of travel of {surfaces[carrier].name}")


def _travel(start: XY, end: XY, surfaces: SurfaceMap, legs: Sequence[Leg]) -> Array | None:
    """Return the direction in which bottles cross a line: of the first leg that does, else of the belt below."""
    for leg in legs:
        crossing = _crossing(leg.points, np.array(start), np.array(end))
        if crossing is not None:
            return crossing
    points = _line(start, end)
    carriers = surfaces.under(points)
    on = np.flatnonzero(carriers != NONE)
    if not on.size:
        return None
    middle = int(on[on.size // 2])
    direction: Array = surfaces[int(carriers[middle])].heading(points[middle][None])[0]
    return direction


def _crossing(points: Array, start: Array, end: Array) -> Array | None:
    """Return the step of a path that crosses a line, (2,), or None."""
    along = end - start
    side = (points[:, 0] - start[0]) * along[1] - (points[:, 1] - start[1]) * along[0]
    for place in np.flatnonzero(side[1:] * side[:-1] < 0.0):
        step = points[place + 1] - points[place]
        where = points[place] + step * side[place] / (side[place] - side[place + 1])
        if 0.0 <= float((where - start) @ along) <= float(along @ along):
            return np.array(step)
    return None


def _footprints(part: object) -> Iterator[Array]:
    """Yield points of each place that a device takes, (k, 2)."""
    if isinstance(part, (PhotoEye, Counter, Inspection)):
        yield _line(part.from_, part.to)
    if isinstance(part, (Zone, Exit)):
        yield _area(part.region)
    if isinstance(part, Giver):
        yield np.array([part.position])


def _line(start: XY, end: XY) -> Array:
    return np.linspace(start, end, SAMPLES)


def _area(region: Sequence[XY]) -> Array:
    """Return points on the sides of a polygon and inside it, (k, 2)."""
    corners = np.array(region)
    sides = [np.linspace(one, other, SAMPLES) for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    low, high = corners.min(axis=0), corners.max(axis=0)
    grid = np.stack(np.meshgrid(*(np.linspace(low[k], high[k], SAMPLES) for k in (0, 1))), axis=-1).reshape(-1, 2)
    return np.vstack([*sides, grid[inside(grid, corners)]])


def _near(surfaces: SurfaceMap, points: Array, reach: float) -> bool:
    """Return True if a belt is at points (k, 2), or within reach of one."""
    turns = np.linspace(0.0, 2.0 * math.pi, 9)[:-1]
    around = reach * np.column_stack([np.cos(turns), np.sin(turns)])
    probes = np.vstack([points, (points[:, None, :] + around[None, :, :]).reshape(-1, 2)])
    return bool((surfaces.under(probes) != NONE).any())

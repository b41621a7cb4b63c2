# SPDX-License-Identifier: Apache-2.0
"""Checks of machines that take bottles: room for waiting bottles, belts, and other machines at the same place."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.scene.geometry import Array, Piece, RailShape, belt_shapes
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.polygons import boxes_meet, inside, why_not_simple
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import XY
from conveyor_sim.scene.words import shown

CELLS = 200
"""Cells along each side of the bounding box of a region."""

CORNERS = np.array([(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)])
"""Corners of a cell from its centre, over its size."""

GIVES = 0.02
"""Overlap of pressed bottles over their diameter."""


def machine_problems(scene: Scene, rails: Sequence[RailShape]) -> Iterator[Problem]:
    """Yield problems of machines that take bottles. rails: those with a valid geometry."""
    takers = {path: part for path, part in scene.exits() if isinstance(part, TakingPart)}
    for path, taker in takers.items():
        if why_not_simple(taker.region) is None:
            yield from _fill_problems(path, taker, scene, rails)
    for path, station in takers.items():
        if isinstance(station, Station) and why_not_simple(station.region) is None:
            yield from _station_problems(path, station, scene)


def _fill_problems(path: Path, taker: TakingPart, scene: Scene, rails: Sequence[RailShape]) -> Iterator[Problem]:
    """Yield a problem for a minimum fill beyond the capacity of the region or zone."""
    if taker.start_fill is None:
        return
    where, region = "its region", taker.region
    if taker.start_zone is not None:
        if taker.start_zone not in scene.zones:
            return
        where, region = f"zone {taker.start_zone}", scene.zones[taker.start_zone].region
        if why_not_simple(region) is not None:
            return
    most = most_axes(region, rails, min(kind.radius for kind in scene.bottle_types.values()))
    if taker.start_fill > most:
        text = f"{taker.start_fill} given, expected at most {most}: {where} can't hold more"
        yield Problem((*path, "start_fill"), text)


def _station_problems(path: Path, station: Station, scene: Scene) -> Iterator[Problem]:
    """Yield problems of a station that takes its own bottles, shares its region, or has no belt in it."""
    if inside(np.array([station.position]), station.region)[0]:
        text = f"{shown(station.position)} given, expected a place outside its region: it would take the bottle again"
        yield Problem((*path, "position"), text)
    points, before = _centres(station.region)[0], True
    for other, part in scene.exits():
        if other == path:
            before = False
            continue
        # Only the first of two stations reports the problem.
        if (before and isinstance(part, Station)) or not boxes_meet(part.region, station.region):
            continue
        if why_not_simple(part.region) is not None:
            continue
        if inside(points, part.region).any() or inside(_centres(part.region)[0], station.region).any():
            text = f"overlaps the region of {other[0]}.{other[1]}, expected a region that is its own"
            yield Problem((*path, "region"), text)
    outlines = (belt.outline() for belt in belt_shapes(scene))
    if not any(boxes_meet(outline, station.region) and inside(points, outline).any() for outline in outlines):
        yield Problem((*path, "region"), "lies on no belt, expected a region to which a belt brings bottles")


def most_axes(region: Sequence[XY], rails: Sequence[RailShape], radius: float) -> int:
    """Return an upper bound on the number of bottles of a radius (m) with axes in a region, beside rails.

    Axes keep a radius from rails. Of points at a distance d from each other, a convex area A of perimeter P holds at
    most 2 A / (sqrt(3) d^2) + P / (2 d) + 1 (Oler, 1961, Acta Math. 105).
    """
    points, cell = _centres(region)
    points = np.vstack([points, np.array(region)])  # a corner may be thinner than a cell
    # A cell counts as free if any point in it may be free.
    far = radius * (1.0 - GIVES) - 0.5 * math.hypot(*cell)
    pieces: list[Piece] = [piece for rail in rails for piece in rail.pieces]
    for piece in pieces:
        points = points[piece.distance(points) >= far] if len(points) else points
    if not len(points):
        return 0
    hull = _convex_hull(np.vstack([points + corner * cell for corner in CORNERS]))
    x, y = hull.T
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
    perimeter = float(np.hypot(x - np.roll(x, -1), y - np.roll(y, -1)).sum())
    apart = 2.0 * radius * (1.0 - GIVES)
    return int(2.0 * area / (math.sqrt(3.0) * apart**2) + 0.5 * perimeter / apart + 1.0)


def _centres(region: Sequence[XY]) -> tuple[Array, Array]:
    """Return centres (n, 2), m, of cells that cover a region, and their width and height (m)."""
    low, high = np.min(region, axis=0), np.max(region, axis=0)
    cell = (high - low) / CELLS
    x, y = (low[k] + cell[k] * (np.arange(CELLS) + 0.5) for k in (0, 1))
    points = np.column_stack([axis.ravel() for axis in np.meshgrid(x, y)])
    near = inside(points, region)
    for corner in CORNERS:
        near |= inside(points + corner * cell, region)
    return points[near], cell


def _convex_hull(points: Array) -> Array:
    """Return the corners of the convex hull of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0)
    # Of points of the same x only the lowest and the highest can be corners.
    _, first = np.unique(ordered[:, 0], return_index=True)
    last = np.append(first[1:], len(ordered)) - 1
    ends = ordered[np.unique(np.concatenate([first, last]))]
    halves = [_chain(half.tolist()) for half in (ends, ends[::-1])]
    return np.array(halves[0][:-1] + halves[1][:-1])


def _chain(points: list[list[float]]) -> list[list[float]]:
    chain: list[list[float]] = []
    for point in points:
        while len(chain) > 1 and _left(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


def _left(a: list[float], b: list[float], c: list[float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

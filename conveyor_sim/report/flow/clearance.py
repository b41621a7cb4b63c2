# SPDX-License-Identifier: Apache-2.0
"""Clear width along the path of a bottle: guides and edges of belts on either side."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from conveyor_sim.report.flow.guides import Guides, left_of
from conveyor_sim.report.flow.surfaces import NONE, Indices, Mask, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.geometry import Array

SPACING = 0.5
"""Distance of samples over radius."""

WIDEST = 3.0
"""m, farthest edge of belts that is looked for."""

MOST_OFFSETS = 100
"""Largest number of places across belts that are compared with them."""

TWO_ROWS = 2.0 + math.sqrt(3.0)
"""Clear width over radius from which two staggered rows of bottles fit side by side."""


@dataclass(frozen=True, eq=False)
class Clearance:
    """Samples along a leg, k of them, SPACING apart. Sides are those seen along the path, right first."""

    radius: float
    ways: Array
    """(k,), m along the path."""
    times: Array
    """(k,), s"""
    points: Array
    """(k, 2), m"""
    directions: Array
    """(k, 2), unit vectors along the path."""
    carriers: Indices
    """(k,), index of the surface, or NONE."""
    guides: Array
    """(2, k), m from the point to the guide on each side; inf without one."""
    edges: Array
    """(2, k), m from the point to the edge of all belts side by side."""

    @property
    def guided(self) -> Mask:
        """True where a guide keeps the bottle on the belts, (2, k)."""
        guided: Mask = self.guides <= self.edges + self.radius
        return guided

    @property
    def width(self) -> Array:
        """Clear width for the outlines of bottles, (k,), m. Where no guide is, the axis reaches the edge."""
        width: Array = np.where(self.guided, self.guides, self.edges + self.radius).sum(axis=0)
        return width

    @property
    def wide(self) -> Mask:
        """True where two rows of bottles fit side by side, (k,)."""
        wide: Mask = self.width >= TWO_ROWS * self.radius
        return wide


def clearance(leg: Leg, surfaces: SurfaceMap, guides: Guides) -> Clearance | None:
    """Return the samples of a leg; None for a bottle that has not moved by its radius."""
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(leg.points, axis=0).T))])
    if ways[-1] < leg.radius:
        return None
    marks = np.arange(0.0, ways[-1], SPACING * leg.radius)
    points = np.column_stack([np.interp(marks, ways, leg.points[:, axis]) for axis in (0, 1)])
    ahead = np.minimum(marks + leg.radius, ways[-1])
    behind = np.maximum(marks - leg.radius, 0.0)
    along = np.column_stack(
        [np.interp(ahead, ways, leg.points[:, axis]) - np.interp(behind, ways, leg.points[:, axis]) for axis in (0, 1)]
    )
    directions = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    left = left_of(directions)
    return Clearance(
        leg.radius,
        marks,
        np.interp(marks, ways, leg.times),
        points,
        directions,
        surfaces.under(points),
        np.array([guides.distance(points, side) for side in (-left, left)]),
        np.array([_edges(points, side, surfaces, leg.radius) for side in (-left, left)]),
    )


def _edges(points: Array, directions: Array, surfaces: SurfaceMap, radius: float) -> Array:
    """Return the distance (k,) from points along directions to the edge of the belts side by side, to half a radius."""
    reach = min(WIDEST, max((surface.shape.width for surface in surfaces), default=0.0) * 2.0)
    step = max(SPACING * radius, reach / MOST_OFFSETS)
    offsets = np.arange(0.0, reach + radius, step)
    every = max(1, round(1.0 / SPACING))  # a sample per radius is enough for edges
    some = np.unique(np.append(np.arange(0, len(points), every), len(points) - 1))
    probes = points[some, None, :] + offsets[None, :, None] * directions[some, None, :]
    on = (surfaces.under(probes.reshape(-1, 2)) != NONE).reshape(len(some), len(offsets))
    # The first offset beyond the belts; a seam between two belts is no edge.
    on[:, :-1] |= on[:, 1:]
    first_off = np.where(on.all(axis=1), len(offsets) - 1, np.argmin(on, axis=1))
    edges = np.maximum(offsets[first_off] - 0.5 * step, 0.0)
    # Between two samples the larger edge holds, so that no edge comes before a guide where belts widen.
    after = np.minimum(np.searchsorted(some, np.arange(len(points))), len(some) - 1)
    before = np.maximum(after - 1, 0)
    larger: Array = np.maximum(edges[before], edges[after])
    return larger

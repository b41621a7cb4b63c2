# SPDX-License-Identifier: Apache-2.0
"""Guides: distances from a point to the rails on either side."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from conveyor_sim.scene.geometry import ArcPiece, Array, Piece, SegmentPiece

_AT_ONCE = 2_000_000
"""Pairs of a ray and a piece that are computed in one step: some 100 MB."""


class Guides:
    """Rail pieces, for rays that look for the first of them."""

    def __init__(self, pieces: Iterable[Piece]) -> None:
        pieces = tuple(pieces)
        segments = [piece for piece in pieces if isinstance(piece, SegmentPiece)]
        self._ends = np.array([end for piece in pieces for end in piece.ends]).reshape(-1, 2)
        arcs = [piece for piece in pieces if isinstance(piece, ArcPiece)]
        self._start = np.array([piece.p1 for piece in segments]).reshape(-1, 2)
        self._along = np.array([piece.p2 for piece in segments]).reshape(-1, 2) - self._start
        self._centre = np.array([piece.centre for piece in arcs]).reshape(-1, 2)
        self._arc = np.array([(piece.radius, piece.start_angle, piece.span) for piece in arcs]).reshape(-1, 3)

    def nearest_end(self, point: Array) -> Array:
        """Return the end of a piece that is nearest to a point (2,). There must be a piece."""
        end: Array = self._ends[np.argmin(np.hypot(*(self._ends - point).T))]
        return end

    def distance(self, points: Array, directions: Array) -> Array:
        """Return the distance (k,) from points (k, 2) along unit vectors (k, 2) to the first rail; inf without one."""
        rows = max(1, _AT_ONCE // max(1, len(self._start) + len(self._centre)))
        parts = [
            self._distance(points[first : first + rows], directions[first : first + rows])
            for first in range(0, len(points), rows)
        ]
        return np.concatenate(parts) if parts else np.empty(0)

    def _distance(self, points: Array, directions: Array) -> Array:
        distance = np.full(len(points), math.inf)
        if len(self._start):
            distance = np.minimum(distance, self._to_segments(points, directions).min(axis=1))
        if len(self._centre):
            distance = np.minimum(distance, self._to_arcs(points, directions).min(axis=1))
        return distance

    def _to_segments(self, points: Array, directions: Array) -> Array:
        """Return distances (k, segments), inf without an intersection."""
        to_start = self._start[None, :, :] - points[:, None, :]
        cross = _cross(directions[:, None, :], self._along[None, :, :])
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = _cross(to_start, self._along[None, :, :]) / cross
            share = _cross(to_start, directions[:, None, :]) / cross
        hit = (np.abs(cross) > 1e-12) & (ahead >= 0.0) & (share >= 0.0) & (share <= 1.0)
        return np.where(hit, ahead, math.inf)

    def _to_arcs(self, points: Array, directions: Array) -> Array:
        """Return distances (k, arcs), inf without an intersection."""
        seen = points[:, None, :] - self._centre[None, :, :]
        radius, start, span = self._arc.T
        half = (seen * directions[:, None, :]).sum(axis=2)
        inside = half * half - (seen * seen).sum(axis=2) + radius * radius
        root = np.sqrt(np.maximum(inside, 0.0))
        best = np.full(half.shape, math.inf)
        for ahead in (-half - root, -half + root):
            touched = seen + ahead[:, :, None] * directions[:, None, :]
            turned = np.mod(np.arctan2(touched[:, :, 1], touched[:, :, 0]) - start, 2.0 * math.pi)
            hit = (inside >= 0.0) & (ahead >= 0.0) & (turned <= span)
            best = np.where(hit, np.minimum(best, ahead), best)
        return best


def left_of(directions: Array) -> Array:
    """Return unit vectors turned left by a quarter, (k, 2)."""
    return np.column_stack([-directions[:, 1], directions[:, 0]])


def _cross(one: Array, other: Array) -> Array:
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]

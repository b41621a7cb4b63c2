# SPDX-License-Identifier: Apache-2.0
"""Which bottles went through a rail between two ticks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.geometry import ArcPiece, Piece, SegmentPiece

F8 = NDArray[np.float64]


def crossed(piece: Piece, before: F8, after: F8) -> NDArray[np.bool_]:
    """Whether the straight ways from `before` to `after`, (n, 2) each, cross a piece of a rail."""
    if isinstance(piece, SegmentPiece):
        return _crossed_segment(piece, before, after)
    return _crossed_arc(piece, before, after)


def _crossed_segment(piece: SegmentPiece, before: F8, after: F8) -> NDArray[np.bool_]:
    start, end = np.array(piece.p1), np.array(piece.p2)
    of_rail = _side(start, end, before) * _side(start, end, after) < 0.0
    way = after - before
    of_way = _cross(way, start - before) * _cross(way, end - before) < 0.0
    return np.asarray(of_rail & of_way)


def _crossed_arc(piece: ArcPiece, before: F8, after: F8) -> NDArray[np.bool_]:
    """Crossings of the whole circle, where |before + t way - centre| is the radius, that lie in the arc's span."""
    seen, way = before - np.array(piece.centre), after - before
    a = np.einsum("ij,ij->i", way, way)
    half = np.einsum("ij,ij->i", seen, way)
    c = np.einsum("ij,ij->i", seen, seen) - piece.radius**2
    root = half**2 - a * c
    moved = (a > 0.0) & (root > 0.0)
    found = np.zeros(len(before), bool)
    for sign in (-1.0, 1.0):
        share = (-half + sign * np.sqrt(np.where(moved, root, 0.0))) / np.where(moved, a, 1.0)
        at = seen + share[:, None] * way
        angle = np.mod(np.arctan2(at[:, 1], at[:, 0]) - piece.start_angle, 2.0 * math.pi)
        # Twice through the circle in one tick is a way that comes back to its side.
        found ^= moved & (share > 0.0) & (share < 1.0) & (angle < piece.span)
    return found


def _side(start: F8, end: F8, points: F8) -> F8:
    return _cross(end - start, points - start)


def _cross(one: F8, other: F8) -> F8:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])

# SPDX-License-Identifier: Apache-2.0
"""Pieces of drawn curves: straight lines and arcs, as in a polyline of DXF. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.types import XY

JOIN = 1.5e-4
"""Largest distance (m) of two ends that are treated as one."""
SMOOTH = math.radians(0.2)
"""Largest change of direction (rad) at a joint that is treated as none: a joint of ends that are JOIN apart."""


@dataclass(frozen=True)
class DrawnPiece:
    """A straight line, or an arc by its bulge: the tangent of a quarter of its angle, positive to the left."""

    start: XY
    end: XY
    bulge: float = 0.0

    @property
    def reversed(self) -> DrawnPiece:
        """The piece drawn the other way."""
        return DrawnPiece(self.end, self.start, -self.bulge)

    @cached_property
    def chord(self) -> float:
        """Distance of the ends."""
        return math.dist(self.start, self.end)

    @property
    def turn(self) -> float:
        """Change of direction, positive to the left; 0 of a straight line."""
        return 4.0 * math.atan(self.bulge)

    @property
    def radius(self) -> float:
        """Radius; infinite of a straight line."""
        return self.chord * (1.0 + self.bulge**2) / (4.0 * abs(self.bulge)) if self.bulge else math.inf

    @property
    def length(self) -> float:
        """Length along the piece."""
        return self.radius * abs(self.turn) if self.bulge else self.chord

    @property
    def centre(self) -> XY:
        """Centre of an arc."""
        (x0, y0), (x1, y1) = self.start, self.end
        lever = (1.0 - self.bulge**2) / (4.0 * self.bulge)  # distance of the centre from the chord, over the chord
        return (x0 + x1) / 2 - lever * (y1 - y0), (y0 + y1) / 2 + lever * (x1 - x0)

    @property
    def headings(self) -> tuple[float, float]:
        """Directions of travel at the start and at the end."""
        chord = math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])
        return chord - self.turn / 2, chord + self.turn / 2

    def nearest(self, point: XY) -> tuple[float, float]:
        """Return the distance of a point from the piece, and the station of the nearest point on the piece."""
        if not self.bulge:
            (x, y), (dx, dy) = self.start, (self.end[0] - self.start[0], self.end[1] - self.start[1])
            share = ((point[0] - x) * dx + (point[1] - y) * dy) / self.chord**2 if self.chord else 0.0
            share = min(1.0, max(0.0, share))
            return math.dist(point, (x + share * dx, y + share * dy)), share * self.chord
        centre, sign = self.centre, math.copysign(1.0, self.bulge)
        first = math.atan2(self.start[1] - centre[1], self.start[0] - centre[0])
        seen = math.atan2(point[1] - centre[1], point[0] - centre[0])
        turned = (sign * (seen - first)) % (2 * math.pi)
        if turned <= abs(self.turn):
            return abs(math.dist(point, centre) - self.radius), turned * self.radius
        ends = (math.dist(point, self.start), 0.0), (math.dist(point, self.end), self.length)
        return min(ends)


def length_of(pieces: Sequence[DrawnPiece]) -> float:
    """Return the length of a curve."""
    return sum(piece.length for piece in pieces)


def nearest(pieces: Sequence[DrawnPiece], point: XY) -> tuple[float, float]:
    """Return the distance of a point from a curve, and the station of the nearest point on the curve."""
    best, before = (math.inf, 0.0), 0.0
    for piece in pieces:
        away, station = piece.nearest(point)
        if away < best[0]:
            best = away, before + station
        before += piece.length
    return best


def box_of(pieces: Sequence[DrawnPiece]) -> tuple[float, float, float, float]:
    """Return least x and y, and greatest, of a box that holds a curve."""
    points = [at for piece in pieces for at in (piece.start, piece.end)]
    reach = max((2.0 * piece.radius for piece in pieces if piece.bulge), default=0.0)
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return min(xs) - reach, min(ys) - reach, max(xs) + reach, max(ys) + reach


def within(boxes: NDArray[np.float64], at: XY, reach: float) -> list[int]:
    """Return the indices of the boxes (n, 4) that a point lies in, or at most `reach` (m) beside."""
    (x, y), (x0, y0, x1, y1) = at, boxes.T
    inside = (x >= x0 - reach) & (x <= x1 + reach) & (y >= y0 - reach) & (y <= y1 + reach)
    indices: list[int] = np.flatnonzero(inside).tolist()
    return indices


def reversed_curve(pieces: Sequence[DrawnPiece]) -> tuple[DrawnPiece, ...]:
    """Return a curve drawn the other way."""
    return tuple(piece.reversed for piece in reversed(pieces))


def corner(before: DrawnPiece, after: DrawnPiece) -> float:
    """Return the change of direction at a joint, from -pi to pi, positive to the left."""
    return turned_by(before.headings[1], after.headings[0])


def turned_by(first: float, second: float) -> float:
    """Return the angle from one direction to another, from -pi to pi."""
    return math.remainder(second - first, 2 * math.pi)


def fitted(points: Sequence[XY]) -> tuple[list[DrawnPiece], float]:
    """Return the line or arc (at most a half circle) through a curve's ends and its middle, and its largest distance
    (m) from the points.
    """
    start, end = points[0], points[-1]
    middle = min(points, key=lambda at: abs(math.dist(at, start) - math.dist(at, end)))
    first, last = (math.atan2(middle[1] - at[1], middle[0] - at[0]) for at in (start, end))
    turn = 2.0 * turned_by(first, last + math.pi)
    straight = DrawnPiece(start, end)
    pieces = [straight]
    if straight.chord > 0.0 and 1e-3 < abs(turn) <= math.pi * (1.0 + 1e-9):
        pieces = [DrawnPiece(start, end, math.tan(turn / 4))]
    return pieces, max(nearest(pieces, at)[0] for at in points)


def arc(start: XY, end: XY, turn: float, middle: XY) -> list[DrawnPiece]:
    """Return an arc; as two halves if it turns by more than a half circle. middle: point half-way along the arc."""
    if abs(turn) <= math.pi * (1.0 + 1e-12):
        return [DrawnPiece(start, end, math.tan(turn / 4))]
    bulge = math.tan(turn / 8)
    return [DrawnPiece(start, middle, bulge), DrawnPiece(middle, end, bulge)]

# SPDX-License-Identifier: Apache-2.0
"""Paths of conveyors: straight pieces and bends, end to end. The end of a piece and the start of the next are one."""

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

from conveyor_sim.scene.layout.frames import PathFrame, turned
from conveyor_sim.scene.types import TOUCH, XY


@dataclass(frozen=True)
class Straight:
    """A straight piece of a path."""

    start: PathFrame
    end: PathFrame
    length: float

    @classmethod
    def of(cls, start: PathFrame, length: float) -> "Straight":
        """Build the piece of a length (m) that begins at a frame."""
        return cls(start, start.moved(length), length)

    def frame(self, s: float) -> PathFrame:
        """Return the frame at a distance (m) from the start of the piece; exactly `start` and `end` at its ends."""
        return self.start if s == 0.0 else self.end if s == self.length else self.start.moved(s)

    def between(self, s0: float, s1: float) -> "Straight":
        """Return the part between two distances (m) from its start."""
        return Straight(self.frame(s0), self.frame(s1), s1 - s0)


@dataclass(frozen=True)
class Bend:
    """An arc of a path."""

    start: PathFrame
    end: PathFrame
    centre: XY
    radius: float
    """Radius of the path (m)."""
    turn: float
    """Change of direction (rad), positive to the left."""

    @classmethod
    def of(cls, start: PathFrame, turn: float, radius: float) -> "Bend":
        """Build the arc of a radius (m) that begins at a frame and changes its direction by `turn` (rad)."""
        centre = start.point(0.0, math.copysign(radius, turn))
        return cls(start, _on_arc(centre, turned(start.angle, turn), math.copysign(radius, turn)), centre, radius, turn)

    @property
    def length(self) -> float:
        """Length (m)."""
        return abs(self.turn) * self.radius

    @property
    def left_radius(self) -> float:
        """Radius (m), negative if the arc turns to the right. Minus an offset to the left, it is that of the offset."""
        return math.copysign(self.radius, self.turn)

    def frame(self, s: float) -> PathFrame:
        """Return the frame at a distance (m) from the start of the piece; exactly `start` and `end` at its ends."""
        if s == 0.0 or s == self.length:
            return self.end if s else self.start
        return _on_arc(self.centre, turned(self.start.angle, self.turn * (s / self.length)), self.left_radius)

    def between(self, s0: float, s1: float) -> "Bend":
        """Return the part between two distances (m) from its start."""
        turn = self.turn * ((s1 - s0) / self.length)
        return Bend(self.frame(s0), self.frame(s1), self.centre, self.radius, turn)


PathPiece = Straight | Bend


def _on_arc(centre: XY, angle: float, left_radius: float) -> PathFrame:
    return PathFrame(*PathFrame(*centre, angle).point(0.0, -left_radius), angle)


@dataclass(frozen=True)
class Route:
    """A path: at least one piece. Stations are distances (m) along it, offsets are positive to the left."""

    pieces: tuple[PathPiece, ...]

    @cached_property
    def stations(self) -> tuple[float, ...]:
        """Stations (m) of the start of each piece, and of the end of the path."""
        return tuple(accumulate((piece.length for piece in self.pieces), initial=0.0))

    @property
    def length(self) -> float:
        """Length (m)."""
        return self.stations[-1]

    @property
    def start(self) -> PathFrame:
        """Frame at the start."""
        return self.pieces[0].start

    @property
    def end(self) -> PathFrame:
        """Frame at the end."""
        return self.pieces[-1].end

    def frame(self, s: float) -> PathFrame:
        """Return the frame at a station (m). Raise ValueError if it is not on the path."""
        index, inside = self._place(s)
        return self.pieces[index].frame(inside)

    def point(self, s: float, offset: float = 0.0) -> XY:
        """Return the point at a station and an offset (m). Raise ValueError if the station is not on the path."""
        return self.frame(s).point(0.0, offset)

    def heading(self, s: float) -> float:
        """Return the direction of travel (rad) at a station (m). Raise ValueError if it is not on the path."""
        return self.frame(s).angle

    def between(self, s0: float, s1: float) -> "Route":
        """Return the part between two stations (m), s0 < s1. Raise ValueError if they are not on the path."""
        return Route(tuple(part for _, part in self.parts(s0, s1)))

    def parts(self, s0: float, s1: float) -> Iterator[tuple[int, PathPiece]]:
        """Yield the pieces between two stations (m), s0 < s1, with their numbers; pieces at the ends are cut.

        Raise ValueError if the stations are not on the path.
        """
        if not s1 - s0 > TOUCH:
            raise ValueError(f"stations {s0:g} m and {s1:g} m, expected the smaller one first")
        first, begin = self._place(s0)
        last, end = self._place(s1)
        if end == 0.0:
            last, end = last - 1, self.pieces[last - 1].length
        for index in range(first, last + 1):
            piece = self.pieces[index]
            low, high = begin if index == first else 0.0, end if index == last else piece.length
            yield index, piece if low == 0.0 and high == piece.length else piece.between(low, high)

    def _place(self, s: float) -> tuple[int, float]:
        """Return a piece and the distance (m) from its start. A station within TOUCH of a joint is the joint."""
        if not -TOUCH <= s <= self.length + TOUCH:
            raise ValueError(f"station {s:g} m, expected one from 0 to {self.length:g} m")
        index = min(max(bisect_right(self.stations, s) - 1, 0), len(self.pieces) - 1)
        inside = s - self.stations[index]
        if self.pieces[index].length - inside <= TOUCH:
            last = index == len(self.pieces) - 1
            return (index, self.pieces[index].length) if last else (index + 1, 0.0)
        return index, 0.0 if inside <= TOUCH else inside


def route_of(start: PathFrame, moves: Sequence[tuple[float, float]]) -> Route:
    """Return the path from a frame by moves: (0, length) for straight pieces, (turn, radius) for bends; m and rad."""
    pieces: list[PathPiece] = []
    for turn, size in moves:
        pieces.append(Straight.of(start, size) if turn == 0.0 else Bend.of(start, turn, size))
        start = pieces[-1].end
    return Route(tuple(pieces))

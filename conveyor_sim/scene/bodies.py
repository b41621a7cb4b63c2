# SPDX-License-Identifier: Apache-2.0
"""Bodies under axes: rigid sets of rail pieces, and the motion that an axis gives them. Pure functions; m and rad.

An axis has one coordinate u. A body has the coordinate c = u - lag, in a train c = (u - lag) mod period. Its
displacement is s = c, or s = C(c) with a cam. A body slides by s along a direction, and turns by `turning` s about its
pivot. Outside the range of its cam, a body is absent.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.geometry import ArcPiece, Array, Piece, RailShape, SegmentPiece
from conveyor_sim.scene.types import XY


@dataclass(frozen=True)
class Cam:
    """Displacement s = C(u) over a range of a coordinate u, piecewise quadratic."""

    parts: tuple[tuple[float, float, float, float], ...]
    """u, s, ds/du and d2s/du2 at the start of each part, in ascending order of u."""
    end: float
    """Coordinate at which the last part ends."""

    @property
    def start(self) -> float:
        """Coordinate at which the first part starts."""
        return self.parts[0][0]

    def at(self, u: float) -> tuple[float, float]:
        """Return displacement and slope ds/du at a coordinate in the range."""
        since = np.array([part[0] for part in self.parts])
        first, s, slope, curvature = self.parts[max(0, int(np.searchsorted(since, u, side="right")) - 1)]
        return s + (slope + 0.5 * curvature * (u - first)) * (u - first), slope + curvature * (u - first)

    def extremes(self) -> tuple[float, float]:
        """Return the least and the greatest displacement."""
        places = [self.start, self.end]
        for (first, _, slope, curvature), last in zip(self.parts, self._ends(), strict=True):
            places.append(first)
            if curvature and first < first - slope / curvature < last:
                places.append(first - slope / curvature)
        values = [self.at(place)[0] for place in places]
        return min(values), max(values)

    def steepest(self) -> float:
        """Return the greatest |ds/du|."""
        parts = zip(self.parts, self._ends(), strict=True)
        return max(max(abs(b), abs(b + c * (last - first))) for (first, _, b, c), last in parts)

    def _ends(self) -> list[float]:
        return [*(part[0] for part in self.parts[1:]), self.end]


@dataclass(frozen=True)
class Slide:
    """Displacement of a body along a second direction, as a train that enters and leaves from the side has it."""

    direction: XY
    """Unit vector."""
    cam: Cam
    """Displacement (m) over the range of the body's cam."""


@dataclass(frozen=True)
class AxisShape:
    """Axis: a coordinate that drives bodies. `position`: between two end stops. `velocity`: without end stops."""

    name: str
    """Name such as `gates/exit` or `axes/star`."""
    kind: Literal["position", "velocity"]
    stroke: float
    """Largest position, m or rad; 0 is home. Infinite without end stops."""
    max_speed: float
    """m/s, or rad/s."""
    acceleration: float
    """m/s^2, or rad/s^2."""
    first: float
    """Position at the beginning of the run."""
    limit: float | None
    """Largest force or torque of its drive, N or N m; None without limit."""
    inertia: float
    """Moving mass in kg, or moment of inertia in kg m^2."""

    def position(self, value: float) -> float:
        """Return the position (m or rad) from the signal `<name>/position`, which is a share of a finite stroke."""
        return value * self.stroke if self.kind == "position" else value


@dataclass(frozen=True)
class BodyShape:
    """Rigid set of rail pieces that an axis moves; all pieces are one surface."""

    name: str
    """Name of its machine, such as `stars/in`. Bodies of one machine have one name and one rail number."""
    material: str
    pieces: tuple[Piece, ...]
    """Pieces at displacement 0."""
    axis: str
    """Name of its axis; "" for a body at rest."""
    pivot: XY = (0.0, 0.0)
    """Point about which it turns at displacement 0."""
    along: XY = (0.0, 0.0)
    """Unit vector along which it slides, (0, 0) if it only turns."""
    turning: float = 0.0
    """Angle per displacement, counter-clockwise; 0 slides."""
    lag: float = 0.0
    """Coordinate of the axis at which this body has the coordinate 0."""
    cam: Cam | None = None
    period: float | None = None
    """Coordinate after which its motion repeats; None without repetition."""
    slide: Slide | None = None
    surface_speed: float | None = None
    """Speed of the surface along the pieces at the beginning of the run, from p1 to p2, m/s; None for none."""
    clusters: tuple[tuple[int, ...], ...] = ()
    """Consecutive pieces that are tested together, by their index; () divides the pieces automatically."""

    def displacement(self, coordinate: float) -> tuple[float, float] | None:
        """Return the displacements along `along` and along `slide` at a coordinate of the axis; None if absent."""
        place = coordinate - self.lag
        if self.period is not None:
            place = place % self.period
        if self.cam is None:
            return place, 0.0
        if not self.cam.start <= place <= self.cam.end:
            return None
        return self.cam.at(place)[0], 0.0 if self.slide is None else self.slide.cam.at(place)[0]

    def at(self, coordinate: float) -> tuple[Piece, ...]:
        """Return the pieces at a coordinate of the axis (m or rad); none if the body is absent."""
        moved = self.displacement(coordinate)
        return () if moved is None else self._moved(*moved)

    def shape(self, coordinate: float) -> RailShape:
        """Return the body at a coordinate of the axis (m or rad) as a RailShape, which may have no pieces."""
        return RailShape(self.name, self.material, self.at(coordinate))

    def _moved(self, s: float, aside: float) -> tuple[Piece, ...]:
        across = (0.0, 0.0) if self.slide is None else self.slide.direction
        shift = self.along[0] * s + across[0] * aside, self.along[1] * s + across[1] * aside
        angle = self.turning * s
        return tuple(moved_piece(piece, self.pivot, shift, angle) for piece in self.pieces)

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Clusters of pieces, given or automatic: consecutive pieces that one small circle holds."""
        if self.clusters:
            return self.clusters
        circles = [bounding_circle((piece,)) for piece in self.pieces]
        largest = max(radius for _, radius in circles)
        groups: list[list[int]] = []
        for index, piece in enumerate(self.pieces):
            if groups and bounding_circle([*(self.pieces[k] for k in groups[-1]), piece])[1] <= 1.5 * largest:
                groups[-1].append(index)
            else:
                groups.append([index])
        return tuple(tuple(group) for group in groups)

    @cached_property
    def farthest(self) -> float:
        """Greatest distance of any point from the pivot, m."""
        return max(math.dist(centre, self.pivot) + radius for centre, radius in map(_circle, self.pieces))

    @property
    def fastest_point(self) -> float:
        """Largest path of any point per change of the axis's position."""
        straight = 1.0 if any(self.along) else 0.0
        path = straight + abs(self.turning) * self.farthest
        if self.cam is not None:
            path *= self.cam.steepest()
        return path + (0.0 if self.slide is None else self.slide.cam.steepest())

    def sweep(self, stroke: float) -> Array:
        """Return the box of all places of its pieces, (4,): least x and y, greatest x and y.

        stroke: largest position of its axis, m or rad.
        """
        low, high = (0.0, stroke) if self.cam is None else self.cam.extremes()
        if self.turning and math.isinf(high):
            high = 2.0 * math.pi / abs(self.turning)
        boxes = np.array([_swept(piece, self.pivot, self.turning * low, self.turning * high) for piece in self.pieces])
        shifts = np.zeros((1, 2))
        if any(self.along):
            shifts = np.outer([low, high], self.along)
        if self.slide is not None:
            aside = np.outer(self.slide.cam.extremes(), self.slide.direction)
            shifts = (shifts[:, None] + aside).reshape(-1, 2)
        least, greatest = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
        return np.concatenate([least + shifts.min(axis=0), greatest + shifts.max(axis=0)])


def moved_piece(piece: Piece, pivot: XY, shift: XY, angle: float) -> Piece:
    """Return a piece turned about a pivot by an angle (rad), and shifted (m)."""
    if isinstance(piece, SegmentPiece):
        return SegmentPiece(_moved(piece.p1, pivot, shift, angle), _moved(piece.p2, pivot, shift, angle))
    centre = _moved(piece.centre, pivot, shift, angle)
    return replace(piece, centre=centre, start_angle=piece.start_angle + angle)


def _moved(point: XY, pivot: XY, shift: XY, angle: float) -> XY:
    dx, dy, cos, sin = point[0] - pivot[0], point[1] - pivot[1], math.cos(angle), math.sin(angle)
    return (pivot[0] + shift[0]) + (dx * cos - dy * sin), (pivot[1] + shift[1]) + (dx * sin + dy * cos)


def bounding_circle(pieces: Sequence[Piece]) -> tuple[XY, float]:
    """Return centre and radius (m) of a circle that holds all pieces."""
    circles = [_circle(piece) for piece in pieces]
    x, y = np.mean([centre for centre, _ in circles], axis=0).tolist()
    return (x, y), max(math.dist((x, y), centre) + radius for centre, radius in circles)


def _circle(piece: Piece) -> tuple[XY, float]:
    if isinstance(piece, ArcPiece) and piece.span > math.pi:
        return piece.centre, piece.radius
    (x1, y1), (x2, y2) = piece.ends
    return (0.5 * (x1 + x2), 0.5 * (y1 + y2)), 0.5 * math.dist((x1, y1), (x2, y2))


def _swept(piece: Piece, pivot: XY, first: float, last: float) -> list[float]:
    """Return the box (least x and y, greatest x and y) of a piece that turns from one angle (rad) to another."""
    centre, radius = _circle(piece)
    points = piece.ends if isinstance(piece, SegmentPiece) else (centre,)
    margin = 0.0 if isinstance(piece, SegmentPiece) else radius
    places = np.array([place for point in points for place in _path(point, pivot, first, last)])
    return [*(places.min(axis=0) - margin), *(places.max(axis=0) + margin)]


def _path(point: XY, pivot: XY, first: float, last: float) -> Iterator[XY]:
    """Yield extreme points of a path about a pivot from one angle (rad) to another: its ends and axis crossings."""
    low, high = min(first, last), max(first, last)
    yield from (_moved(point, pivot, (0.0, 0.0), angle) for angle in (low, high))
    reach, home = math.dist(point, pivot), math.atan2(point[1] - pivot[1], point[0] - pivot[0])
    quarter = 0.5 * math.pi
    for crossing in range(math.ceil((home + low) / quarter), math.floor((home + high) / quarter) + 1):
        cos, sin = unit_vector(crossing * quarter)
        yield pivot[0] + reach * cos, pivot[1] + reach * sin

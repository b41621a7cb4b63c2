# SPDX-License-Identifier: Apache-2.0
"""Shapes of a scene: surfaces of belts and plates, rails and initial bottles. Pure functions; m and rad."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.areas import CurvedArea, StraightArea
from conveyor_sim.scene.belts import Belt, CurvedBelt, CurvedSurface, PathBelt, StraightSurface
from conveyor_sim.scene.rails import ArcRail, PolylineRail, Rail
from conveyor_sim.scene.schema import Grid, GridOfBottles, Scene
from conveyor_sim.scene.star_places import guide_rails
from conveyor_sim.scene.types import TOUCH, XY
from conveyor_sim.scene.vibration import ChainVibration

Array = NDArray[np.float64]
InitialBottle = tuple[str, float, float, float, float, float, float]


@dataclass(frozen=True)
class BeltShape:
    """A surface: straight (corner, angle, length, width), or curved (centre, inner_radius, start_angle, span, width).

    The numbers of the other kind are 0. A straight surface's `corner` is xi = eta = 0, xi along `angle`, eta to its
    left.
    """

    name: str
    kind: Literal["straight", "curved"]
    width: float
    corner: XY = (0.0, 0.0)
    angle: float = 0.0
    length: float = 0.0
    centre: XY = (0.0, 0.0)
    inner_radius: float = 0.0
    start_angle: float = 0.0
    span: float = 0.0
    material: str = ""
    belt: int | None = None
    """Index of the belt that moves it; None for a plate, which rests."""
    belt_name: str = ""
    """Name of this belt."""
    ratio: float = 1.0
    """Speed along travel over that of the belt."""
    clockwise: bool = False
    """True if a curved surface turns clockwise at positive speed."""
    vibration: ChainVibration | None = None
    """Vibration of its belt; None for none."""

    @property
    def centre_radius(self) -> float:
        """Radius of a curved surface's centre line (m), where its speed holds."""
        return self.inner_radius + self.width / 2

    @property
    def running_length(self) -> float:
        """Length along the centre line, m."""
        return self.length if self.kind == "straight" else self.span * self.centre_radius

    @property
    def outermost(self) -> float:
        """Speed of the fastest point of the surface, over that of the belt; 0 for a plate."""
        if self.belt is None:
            return 0.0
        return self.ratio * (1.0 if self.kind == "straight" else (self.inner_radius + self.width) / self.centre_radius)

    @property
    def outermost_swing(self) -> float:
        """Amplitude of the velocity at the fastest point by the vibration of the belt, m/s."""
        if self.vibration is None:
            return 0.0
        reach = 1.0 if self.kind == "straight" else (self.inner_radius + self.width) / self.centre_radius
        return self.vibration.speed * reach

    def outline(self, n: int = 64) -> Array:
        """Return the corners of the area, (k, 2), counter-clockwise, first not repeated; an arc has n points.

        A full ring is cut open along its start angle; one without a hole is a circle.
        """
        if self.kind == "straight":
            return self._point([0.0, self.length, self.length, 0.0], [0.0, 0.0, self.width, self.width])
        outer = self._arc(self.inner_radius + self.width, n)
        if self.inner_radius > 0:
            return np.vstack([outer, self._arc(self.inner_radius, n)[::-1]])
        return outer[:-1] if is_full_turn(self.span) else np.vstack([outer, [self.centre]])

    def edges(self, n: int = 64) -> tuple[Array, Array]:
        """Return points of the right and of the left edge, (k, 2) each, along positive speed; an arc has n points."""
        if self.kind == "straight":
            along = np.array(unit_vector(self.angle))
            right = np.array(self.corner) + np.outer([0.0, self.length], along)
            return right, right + self.width * np.array([-along[1], along[0]])
        outer, inner = self._arc(self.inner_radius + self.width, n), self._arc(self.inner_radius, n)
        return (inner[::-1], outer[::-1]) if self.clockwise else (outer, inner)

    def centre_line(self, n: int = 64) -> Array:
        """Return points along the middle, (n, 2), in the direction of positive speed."""
        if self.kind == "straight":
            return self._point(np.linspace(0.0, self.length, n), np.full(n, self.width / 2))
        points = self._arc(self.centre_radius, n)
        return points[::-1] if self.clockwise else points

    def _arc(self, radius: float, n: int) -> Array:
        """Return points of an arc of the sector, (n, 2), counter-clockwise, with exact ends at quarter turns."""
        points = arc_points(self.centre, radius, self.start_angle, self.span, n)
        for place, angle in ((0, self.start_angle), (-1, self.start_angle + self.span)):
            cos, sin = unit_vector(angle)
            points[place] = self.centre[0] + radius * cos, self.centre[1] + radius * sin
        return points

    def _point(self, xi: list[float] | Array, eta: list[float] | Array) -> Array:
        """Return global coordinates (k, 2) of surface coordinates (11)-(13)."""
        cos, sin = unit_vector(self.angle)
        xi, eta = np.asarray(xi), np.asarray(eta)
        return np.column_stack([self.corner[0] + cos * xi - sin * eta, self.corner[1] + sin * xi + cos * eta])


@dataclass(frozen=True)
class SegmentPiece:
    """A straight piece of a rail."""

    p1: XY
    p2: XY

    @property
    def ends(self) -> tuple[XY, XY]:
        """Both end points."""
        return self.p1, self.p2

    @property
    def length(self) -> float:
        """Length, m."""
        return math.dist(self.p1, self.p2)

    def points(self, n: int = 64) -> Array:
        """Return the end points, (2, 2)."""
        return np.array([self.p1, self.p2])

    @property
    def box(self) -> tuple[XY, XY]:
        """Lower left and upper right corner of a box that holds the piece."""
        (x1, y1), (x2, y2) = self.p1, self.p2
        return (min(x1, x2), min(y1, y2)), (max(x1, x2), max(y1, y2))

    def distance(self, points: Array) -> Array:
        """Return the distance (k,) of points (k, 2) from the piece, its end points included."""
        start = np.array(self.p1)
        along = np.array(self.p2) - start
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        return _length(points - start - share[:, None] * along)


@dataclass(frozen=True)
class ArcPiece:
    """A piece of a rail along a circle, counter-clockwise from `start_angle` through `span`."""

    centre: XY
    radius: float
    start_angle: float
    span: float

    @property
    def length(self) -> float:
        """Length along the arc, m."""
        return self.radius * self.span

    @property
    def ends(self) -> tuple[XY, XY]:
        """Both end points."""
        first, last = self.points(2)
        return (float(first[0]), float(first[1])), (float(last[0]), float(last[1]))

    def points(self, n: int = 64) -> Array:
        """Return points along the arc, (n, 2)."""
        return arc_points(self.centre, self.radius, self.start_angle, self.span, n)

    @property
    def box(self) -> tuple[XY, XY]:
        """Lower left and upper right corner of a box that holds the piece: that of the whole circle."""
        (x, y), radius = self.centre, self.radius
        return (x - radius, y - radius), (x + radius, y + radius)

    def distance(self, points: Array) -> Array:
        """Return the distance (k,) of points (k, 2) from the arc, its end points included."""
        seen = points - np.array(self.centre)
        angle = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - self.start_angle, 2 * math.pi)
        to_circle = np.abs(_length(seen) - self.radius)
        to_ends = np.min([_length(points - np.array(end)) for end in self.ends], axis=0)
        return np.where(angle <= self.span, to_circle, to_ends)


Piece = SegmentPiece | ArcPiece


@dataclass(frozen=True)
class RailShape:
    """A rail as pieces that follow each other."""

    name: str
    material: str
    pieces: tuple[Piece, ...]

    def outline(self, n: int = 64) -> Array:
        """Return points along the rail, (k, 2); an arc has n points. Arcs are passed in the direction of the rail."""
        lines = [piece.points(n) for piece in self.pieces]
        if len(lines) > 1 and _joins(lines[0][0], lines[1]) and not _joins(lines[0][-1], lines[1]):
            lines[0] = lines[0][::-1]
        for index in range(1, len(lines)):
            end = lines[index - 1][-1]
            if not math.dist(end, lines[index][0]) <= TOUCH and math.dist(end, lines[index][-1]) <= TOUCH:
                lines[index] = lines[index][::-1]
        return np.vstack([lines[0], *(line[1:] for line in lines[1:])])


def _joins(point: Array, line: Array) -> bool:
    """Return True if a point is an end of a line."""
    return math.dist(point, line[0]) <= TOUCH or math.dist(point, line[-1]) <= TOUCH


def arc_points(centre: XY, radius: float, start_angle: float, span: float, n: int) -> Array:
    """Return points of an arc, (n, 2), counter-clockwise (21)."""
    angle = start_angle + np.linspace(0.0, span, n)
    return np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)])


def is_full_turn(span: float) -> bool:
    """Return True if a span is a full turn."""
    return span >= 2 * math.pi - 1e-12


def arc_centre(p1: XY, p2: XY, radius: float, side: str) -> XY:
    """Return the centre of the circle of a radius (m) through two points, "left" or "right" of the line from p1 to p2.

    It follows from the chord's midpoint and perpendicular, so that horizontal chords need no special case (the paper's
    (16)-(20) divide by their height). Raise ValueError if the radius is shorter than half the chord, or the points
    coincide.
    """
    chord_x, chord_y = p2[0] - p1[0], p2[1] - p1[1]
    chord = math.hypot(chord_x, chord_y)
    if chord <= TOUCH:
        raise ValueError("the two points coincide")
    if radius < chord / 2 - TOUCH:
        raise ValueError(f"the radius {radius:g} m is shorter than half the chord, {chord / 2:g} m")
    height = math.sqrt(max((radius - chord / 2) * (radius + chord / 2), 0.0))
    shift = (height if side == "left" else -height) / chord
    return p1[0] + chord_x / 2 - shift * chord_y, p1[1] + chord_y / 2 + shift * chord_x


def area_shape(name: str, area: StraightArea | CurvedArea) -> BeltShape:
    """Return the shape of an area, at rest. Two points on the inner arc mean the shorter arc between them.

    Raise ValueError as in `arc_centre`.
    """
    if isinstance(area, StraightArea):
        return BeltShape(name, "straight", area.width, corner=area.start, angle=area.angle, length=area.length)
    if area.centre is not None and area.start_angle is not None and area.span is not None:
        centre, start, span = area.centre, area.start_angle, area.span
    elif area.from_ is not None and area.to is not None and area.side is not None:
        centre = arc_centre(area.from_, area.to, area.inner_radius, area.side)
        first, last = (area.from_, area.to) if area.side == "left" else (area.to, area.from_)
        start = math.atan2(first[1] - centre[1], first[0] - centre[0])
        span = (math.atan2(last[1] - centre[1], last[0] - centre[0]) - start) % (2 * math.pi)
    else:
        raise ValueError("neither centre, start_angle and span nor from, to and side are given")
    return BeltShape(
        name, "curved", area.width, centre=centre, inner_radius=area.inner_radius, start_angle=start, span=span
    )


def shapes_of_belt(name: str, belt: Belt, index: int = 0) -> tuple[BeltShape, ...]:
    """Return the surfaces of a belt, which has an index among belts. Raise ValueError as in `arc_centre`."""
    surfaces: list[tuple[str, StraightArea | CurvedArea]] = (
        [(name, belt)]
        if not isinstance(belt, PathBelt)
        else [(f"{name}_{number}", surface) for number, surface in enumerate(belt.surfaces, 1)]
    )
    return tuple(
        replace(
            area_shape(label, surface),
            material=belt.material,
            belt=index,
            belt_name=name,
            vibration=belt.vibration,
            ratio=surface.ratio if isinstance(surface, StraightSurface | CurvedSurface) else 1.0,
            clockwise=isinstance(surface, CurvedBelt | CurvedSurface) and surface.turn == "right",
        )
        for label, surface in surfaces
    )


def belt_shapes(scene: Scene) -> list[BeltShape]:
    """Return the surfaces of the belts, belt by belt in the scene's order."""
    return [
        shape for index, (name, belt) in enumerate(scene.belts.items()) for shape in shapes_of_belt(name, belt, index)
    ]


def surface_shapes(scene: Scene) -> list[BeltShape]:
    """Return all surfaces: those of belts, then plates. The index is the number of a surface."""
    plates = (replace(area_shape(name, plate), material=plate.material) for name, plate in scene.plates.items())
    return [*belt_shapes(scene), *plates]


def named_surfaces(shapes: Sequence[BeltShape]) -> dict[int, BeltShape]:
    """Return the surface on which figures name each belt, by its index: the longest, of equal ones the middle one."""
    surfaces: dict[int, list[BeltShape]] = {}
    for shape in shapes:
        if shape.belt is not None:
            surfaces.setdefault(shape.belt, []).append(shape)
    named = {}
    for belt, own in surfaces.items():
        longest = max(shape.running_length for shape in own)
        equal = [shape for shape in own if shape.running_length > longest - TOUCH]
        named[belt] = equal[len(equal) // 2]
    return named


def surface_materials(scene: Scene) -> list[str]:
    """Return the material of each surface, in the order of `surface_shapes`."""
    materials: list[str] = []
    for belt in scene.belts.values():
        materials += [belt.material] * (len(belt.surfaces) if isinstance(belt, PathBelt) else 1)
    return [*materials, *(plate.material for plate in scene.plates.values())]


def rail_pieces(rail: Rail) -> tuple[Piece, ...]:
    """Return the pieces of a rail."""
    if isinstance(rail, ArcRail):
        return (ArcPiece(rail.centre, rail.radius, rail.start_angle, rail.span),)
    if not isinstance(rail, PolylineRail):
        return (SegmentPiece(rail.from_, rail.to),)
    corners = [*rail.points, rail.points[0]] if rail.closed else list(rail.points)
    return tuple(SegmentPiece(*ends) for ends in pairwise(corners))


def rails_of_curved(shape: BeltShape, belt: CurvedBelt) -> Iterator[RailShape]:
    """Yield the rails along the arcs of a curved belt: `<belt>_inner`, `<belt>_outer`."""
    for side, enabled, radius in (
        ("inner", belt.rails.inner, shape.inner_radius),
        ("outer", belt.rails.outer, shape.inner_radius + shape.width),
    ):
        if enabled and belt.rails.material is not None:
            piece = ArcPiece(shape.centre, radius, shape.start_angle, shape.span)
            yield RailShape(f"{shape.name}_{side}", belt.rails.material, (piece,))


def rail_shapes(scene: Scene) -> list[RailShape]:
    """Return the scene's rails in its order, then those of its curved belts, then the guides around star wheels.

    The index is the number of a rail.
    """
    shapes = [RailShape(name, rail.material, rail_pieces(rail)) for name, rail in scene.rails.items()]
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt):
            shapes.extend(rails_of_curved(area_shape(name, belt), belt))
    shapes.extend(RailShape(name, rail.material, rail_pieces(rail)) for name, rail in guide_rails(scene.stars).items())
    return shapes


def grid_points(grid: GridOfBottles) -> Array:
    """Return the positions (rows x columns, 2) of a grid's bottles, row by row."""
    row, column = np.divmod(np.arange(grid.rows * grid.columns), grid.columns)
    hexagonal = grid.pattern == "hexagonal"
    along = grid.pitch * (column + (row % 2) / 2 if hexagonal else column)
    across = grid.pitch * row * (math.sqrt(3) / 2 if hexagonal else 1.0)
    cos, sin = math.cos(grid.angle), math.sin(grid.angle)
    return np.column_stack([grid.origin[0] + cos * along - sin * across, grid.origin[1] + sin * along + cos * across])


def initial_bottles(scene: Scene) -> list[InitialBottle]:
    """Return the initial bottles in order, grids row by row: (type, x, y, theta, vx, vy, omega)."""
    bottles: list[InitialBottle] = []
    for entry in scene.bottles:
        if isinstance(entry, Grid):
            points = grid_points(entry.grid).tolist()
            bottles.extend((entry.grid.type, x, y, 0.0, 0.0, 0.0, 0.0) for x, y in points)
        else:
            bottles.append((entry.type, *entry.position, entry.angle, *entry.velocity, entry.spin))
    return bottles


def _length(vectors: Array) -> Array:
    return np.hypot(vectors[:, 0], vectors[:, 1])

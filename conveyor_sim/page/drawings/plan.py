# SPDX-License-Identifier: Apache-2.0
"""Plan of a scene: curves, regions and names by layer, for files of drawing programs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from conveyor_sim.page.drawings.pieces import DrawnPiece, arc, reversed_curve
from conveyor_sim.scene.geometry import ArcPiece, BeltShape, RailShape, rail_shapes, surface_shapes
from conveyor_sim.scene.layout.plan import ConveyorPlan
from conveyor_sim.scene.layout.routes import Bend
from conveyor_sim.scene.marks import marks_of
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.device_part import Mark
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.star_places import wheels_of
from conveyor_sim.scene.types import XY

LAYERS: dict[str, tuple[str, int]] = {
    "CONVEYORS": ("#98a4b0", 8),
    "BELTS": ("#98a4b0", 8),
    "PLATES": ("#cbd2d9", 9),
    "RAILS": ("#111827", 7),
    "GATES": ("#a3447f", 6),
    "PUSHERS": ("#a3447f", 6),
    "DIVERTERS": ("#a3447f", 6),
    "DIVIDERS": ("#a3447f", 6),
    "ADJUSTABLE": ("#a3447f", 6),
    "CLAMPS": ("#a3447f", 6),
    "STARS": ("#a3447f", 6),
    "SCREWS": ("#a3447f", 6),
    "SIDE_BELTS": ("#a3447f", 6),
    "PHOTO_EYES": ("#0e5a8a", 5),
    "COUNTERS": ("#5b21b6", 30),
    "INSPECTIONS": ("#5b21b6", 30),
    "ZONES": ("#4d5f0a", 3),
    "OUTFEEDS": ("#a3447f", 6),
    "SINKS": ("#a3447f", 6),
    "STATIONS": ("#a3447f", 6),
    "REJECTS": ("#a3447f", 6),
    "CAROUSELS": ("#a3447f", 6),
    "INFEEDS": ("#00735c", 94),
    "SOURCES": ("#00735c", 94),
    "SPILLS": ("#00735c", 94),
}
"""Layers in the order of drawing: colour, and the nearest index of AutoCAD's colours."""


@dataclass(frozen=True)
class DrawnShape:
    """A shape on a layer."""

    layer: str
    name: str
    pieces: tuple[DrawnPiece, ...] = ()
    width: float = 0.0
    """Width of a belt along its axis (m)."""
    is_closed: bool = False
    position: XY | None = None
    """Place of a symbol without a curve (m)."""
    angle: float = 0.0
    """Direction at this place (rad)."""

    @property
    def middle(self) -> XY:
        """Point on the shape where its name is written: half-way along it."""
        if self.position is not None:
            return self.position
        left = sum(piece.length for piece in self.pieces) / 2
        for piece in self.pieces:
            if left <= piece.length:
                break
            left -= piece.length
        share = left / piece.length
        if piece.bulge:
            first = math.atan2(piece.start[1] - piece.centre[1], piece.start[0] - piece.centre[0])
            angle = first + share * piece.turn
            return piece.centre[0] + piece.radius * math.cos(angle), piece.centre[1] + piece.radius * math.sin(angle)
        (x0, y0), (x1, y1) = piece.start, piece.end
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def plan_of(scene: Scene) -> list[DrawnShape]:
    """Return the shapes of a scene's plan, by layer in the order of LAYERS."""
    shapes = [*_belts(scene), *_rails(scene), *_movers(scene), *_wheels(scene), *_marks(scene)]
    order = {layer: index for index, layer in enumerate(LAYERS)}
    return sorted(shapes, key=lambda shape: order[shape.layer])


def _belts(scene: Scene) -> Iterator[DrawnShape]:
    conveyors = scene.layout.conveyors if scene.layout is not None else {}
    laid_out = {belt for conveyor in conveyors.values() for belt in (*conveyor.belts, *conveyor.surfaces)}
    yield from (_conveyor(conveyor) for conveyor in conveyors.values())
    for shape in surface_shapes(scene):
        if shape.name not in laid_out:
            yield _belt(shape, "PLATES" if shape.belt is None else "BELTS")


def _conveyor(conveyor: ConveyorPlan) -> DrawnShape:
    """Return the axis of a conveyor along the middle of its width."""
    right, left = conveyor.edges
    pieces = []
    route, offset = conveyor.route, (right + left) / 2
    for (s0, s1), piece in zip(pairwise(route.stations), route.pieces, strict=True):
        start, end = piece.start.point(0.0, offset), piece.end.point(0.0, offset)
        turn = piece.turn if isinstance(piece, Bend) else 0.0
        pieces += arc(start, end, turn, route.point((s0 + s1) / 2, offset)) if turn else [DrawnPiece(start, end)]
    return DrawnShape("CONVEYORS", conveyor.name, tuple(pieces), left - right)


def _belt(shape: BeltShape, layer: str) -> DrawnShape:
    if shape.kind == "straight":
        cos, sin = math.cos(shape.angle), math.sin(shape.angle)
        x, y = shape.corner[0] - sin * shape.width / 2, shape.corner[1] + cos * shape.width / 2
        straight = [DrawnPiece((x, y), (x + shape.length * cos, y + shape.length * sin))]
        return DrawnShape(layer, shape.name, tuple(straight), shape.width)
    axis = ArcPiece(shape.centre, shape.centre_radius, shape.start_angle, shape.span)
    pieces = reversed_curve(_arc(axis)) if shape.clockwise else tuple(_arc(axis))
    return DrawnShape(layer, shape.name, pieces, shape.width, shape.span >= 2 * math.pi - 1e-12)


def _arc(piece: ArcPiece) -> list[DrawnPiece]:
    start, middle, end = ((float(x), float(y)) for x, y in piece.points(3))
    return arc(start, start if piece.span >= 2 * math.pi - 1e-12 else end, piece.span, middle)


def _rails(scene: Scene) -> Iterator[DrawnShape]:
    for shape in rail_shapes(scene):
        yield DrawnShape("RAILS", shape.name, _curve(shape))


def _curve(shape: RailShape) -> tuple[DrawnPiece, ...]:
    pieces: list[DrawnPiece] = []
    for piece in shape.pieces:
        pieces += _arc(piece) if isinstance(piece, ArcPiece) else [DrawnPiece(*piece.ends)]
    return tuple(pieces)


def _movers(scene: Scene) -> Iterator[DrawnShape]:
    """Yield gates, pushers and other movers where the scene places them."""
    for path, mover in movers_of(scene):
        field, name = map(str, path)
        for body in mover_shape(path, mover)[0]:
            yield from (DrawnShape(field.upper(), name, (DrawnPiece(*piece.ends),)) for piece in body.pieces)


def _wheels(scene: Scene) -> Iterator[DrawnShape]:
    """Yield pitch circles of star wheels, and the lines of bottles at screws and side belts."""
    for name, wheel in wheels_of(scene.stars).items():
        circle = ArcPiece(wheel.centre, wheel.part.pitch_radius, wheel.entry, 2.0 * math.pi)
        yield DrawnShape("STARS", name, tuple(_arc(circle)), is_closed=True)
    for field in ("screws", "side_belts"):
        for name, part in getattr(scene, field).items():
            yield DrawnShape(field.upper(), name, (DrawnPiece(part.from_, part.to),))


def _marks(scene: Scene) -> Iterator[DrawnShape]:
    for mark in marks_of(scene):
        if mark.look == "entry":
            # A station gives bottles back at another place than that where it takes them.
            if mark.kind != "station":
                x, y = mark.points[0]
                yield DrawnShape(_layer(mark), mark.name, position=(float(x), float(y)), angle=mark.direction)
            continue
        corners = [(float(x), float(y)) for x, y in np.asarray(mark.points)]
        is_closed = len(corners) > 2
        ends = pairwise([*corners, corners[0]] if is_closed else corners)
        yield DrawnShape(_layer(mark), mark.name, tuple(DrawnPiece(*pair) for pair in ends), is_closed=is_closed)


def _layer(mark: Mark) -> str:
    return f"{mark.kind}s".upper()

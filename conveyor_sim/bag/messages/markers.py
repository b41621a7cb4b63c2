# SPDX-License-Identifier: Apache-2.0
"""visualization_msgs/MarkerArray for RViz2 and Foxglove: the plant, drawn once, and moving parts, drawn at a rate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.cdr import CdrWriter, xyz_rows
from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.scene.geometry import named_surfaces

if TYPE_CHECKING:
    from conveyor_sim.scene.geometry import BeltShape, RailShape
    from conveyor_sim.scene.parts.device_part import Look, Mark

ARROW, LINE_STRIP, SPHERE_LIST, TEXT_VIEW_FACING, TRIANGLE_LIST = 0, 4, 7, 9, 11
ADD, DELETEALL = 0, 3

Colour = tuple[float, float, float, float]
BELT_COLOURS: tuple[Colour, ...] = ((0.45, 0.52, 0.58, 1.0), (0.53, 0.60, 0.66, 1.0))
RAIL_COLOUR: Colour = (0.95, 0.77, 0.20, 1.0)
ARROW_COLOUR: Colour = (0.92, 0.95, 0.97, 1.0)
BOTTLE_COLOURS: tuple[Colour, ...] = (
    (0.13, 0.55, 0.35, 1.0),
    (0.80, 0.33, 0.18, 1.0),
    (0.22, 0.42, 0.75, 1.0),
    (0.58, 0.32, 0.60, 1.0),
)
LOOKS: dict[Look, tuple[float, float, Colour]] = {
    "beam": (0.06, 0.008, (1.0, 0.45, 0.10, 1.0)),
    "passage": (0.04, 0.008, (0.72, 0.55, 1.0, 1.0)),
    "check": (0.08, 0.012, (0.35, 0.80, 1.0, 1.0)),
    "region": (0.01, 0.006, (0.80, 0.90, 0.30, 1.0)),
    "entry": (0.04, 0.012, (0.25, 0.85, 0.65, 1.0)),
    "exit": (0.01, 0.008, (0.95, 0.50, 0.80, 1.0)),
}
"""By look of a mark: height above the belts, m; thickness, m; colour. All are bright, as the belts are dark."""
ENTRY_SIZE = 0.1
"""m, height of the triangle whose tip is where bottles enter."""
ARC_STEP = math.radians(4.0)
ARROW_SPACING = 0.5
"""m along a belt from one arrow to the next."""
RAIL_THICKNESS = 0.012
"""Thickness of the line that represents a rail, m."""


@dataclass(frozen=True)
class Marker:
    """Used fields of visualization_msgs/Marker; points are rows (n, 3) in m."""

    ns: str
    id: int
    type: int
    scale: tuple[float, float, float]
    colour: Colour
    points: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    text: str = ""
    action: int = ADD


CLEAR = Marker("", 0, ARROW, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), action=DELETEALL)


def marker_array(markers: Sequence[Marker], header: Header) -> bytes:
    """Return a MarkerArray as CDR bytes: the complete drawing.

    Its first marker deletes earlier ones of the topic, which may be of another scene that the viewer has shown before.
    """
    writer = CdrWriter()
    writer.pack("I", 1 + len(markers))
    for marker in (CLEAR, *markers):
        _write(writer, marker, header)
    return writer.finish()


def _write(writer: CdrWriter, marker: Marker, header: Header) -> None:
    writer.stamp(header.stamp_ns)
    look = marker.ns, marker.id, marker.type, marker.action, marker.position, marker.scale, marker.colour
    writer.raw(_before_points(writer.phase, header.frame_id, *look))
    writer.rows(marker.points)
    writer.raw(_behind_points(writer.phase, marker.text))


@lru_cache(maxsize=1024)
def _before_points(
    phase: int,
    frame_id: str,
    ns: str,
    number: int,
    kind: int,
    action: int,
    position: tuple[float, float, float],
    scale: tuple[float, float, float],
    colour: Colour,
) -> bytes:
    """Return a Marker's fields between the stamp and the points, for a phase of the message's alignment."""
    writer = CdrWriter(phase)
    writer.string(frame_id)
    writer.string(ns)
    writer.pack("i", number, kind, action)
    writer.pack("d", *position, 0.0, 0.0, 0.0, 1.0)
    writer.pack("d", *scale)
    writer.pack("f", *colour)
    writer.pack("i", 0, 0)  # lifetime: for ever
    writer.pack("?", False)  # frame_locked
    return writer.part()


@lru_cache(maxsize=1024)
def _behind_points(phase: int, text: str) -> bytes:
    """Return a Marker's fields behind the points, for a phase of the message's alignment."""
    writer = CdrWriter(phase)
    writer.pack("I", 0)  # colors: one colour for all points
    writer.string("")  # texture_resource
    writer.header(0, "")  # texture, a CompressedImage: header, format, data
    writer.string("")
    writer.pack("I", 0)
    writer.pack("I", 0)  # uv_coordinates
    writer.string(text)
    writer.string("")  # mesh_resource
    writer.string("")  # mesh_file: filename, data
    writer.pack("I", 0)
    writer.pack("?", False)  # mesh_use_embedded_materials
    return writer.part()


def bottles_markers(
    columns: BottleColumns, radii: NDArray[np.float64], moving: Sequence[RailShape], header: Header
) -> bytes:
    """Return the markers of moving parts: one SPHERE_LIST per bottle type present, resting on z = 0; moving rails."""
    markers = []
    for index, radius in enumerate(radii):
        chosen = np.flatnonzero(columns.type == index)
        if not chosen.size:
            continue
        points = np.empty((chosen.size, 3))
        points[:, 0], points[:, 1], points[:, 2] = columns.x[chosen], columns.y[chosen], radius
        colour = BOTTLE_COLOURS[index % len(BOTTLE_COLOURS)]
        size = 2.0 * float(radius)
        markers.append(Marker("bottles", index, SPHERE_LIST, (size, size, size), colour, points))
    return marker_array([*markers, *_rails("moving_rails", moving)], header)


def plant_markers(
    surfaces: Sequence[BeltShape], rails: Sequence[RailShape], marks: Sequence[Mark], header: Header
) -> bytes:
    """Return the markers of the plant: surfaces, arrows along positive speed, fixed rails, device marks, names."""
    markers = [*_surfaces(surfaces), *_arrows(surfaces), *_rails("rails", rails), *_names(surfaces), *_marks(marks)]
    return marker_array(markers, header)


def _surfaces(surfaces: Sequence[BeltShape]) -> Iterator[Marker]:
    for index, surface in enumerate(surfaces):
        # The last listed surface carries, so it lies on top; a tenth of a millimetre keeps surfaces from flickering.
        height = -0.01 + 1e-4 * index
        right, left = surface.edges(1 + math.ceil(surface.span / ARC_STEP))
        corners = np.stack((right[:-1], right[1:], left[:-1], left[:-1], right[1:], left[1:]), axis=1)
        colour = BELT_COLOURS[index % len(BELT_COLOURS)]
        yield Marker("belts", index, TRIANGLE_LIST, (1.0, 1.0, 1.0), colour, xyz_rows(corners.reshape(-1, 2), height))


def _arrows(surfaces: Sequence[BeltShape]) -> Iterator[Marker]:
    number = 0
    for surface in surfaces:
        if surface.belt is None:
            continue
        line = surface.centre_line(33)
        length = float(np.sum(np.hypot(*np.diff(line, axis=0).T)))
        count = max(1, round(length / ARROW_SPACING))
        reach = min(0.6 * length / count, surface.width)
        size = (0.08 * reach, 0.2 * reach, 0.3 * reach)
        for place in (np.arange(count) + 0.5) / count * length:
            ends = _along(line, np.array([place - 0.5 * reach, place + 0.5 * reach]))
            yield Marker("directions", number, ARROW, size, ARROW_COLOUR, xyz_rows(ends, 0.005))
            number += 1


def _along(line: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of a polyline (k, 2) at distances from its start, m."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    distance = np.concatenate(([0.0], np.cumsum(steps)))
    return np.column_stack([np.interp(places, distance, line[:, axis]) for axis in (0, 1)])


def _rails(space: str, rails: Sequence[RailShape]) -> Iterator[Marker]:
    for index, rail in enumerate(rails):
        points = xyz_rows(rail.outline(33), 0.03)
        yield Marker(space, index, LINE_STRIP, (RAIL_THICKNESS, 0.0, 0.0), RAIL_COLOUR, points)


def _names(surfaces: Sequence[BeltShape]) -> Iterator[Marker]:
    for belt, surface in named_surfaces(surfaces).items():
        x, y = surface.centre_line(3)[1]
        size = (0.0, 0.0, min(0.12, 0.4 * surface.width))
        yield Marker(
            "names", belt, TEXT_VIEW_FACING, size, ARROW_COLOUR, position=(x, y, 0.2), text=surface.belt_name
        )  # fmt: skip


def _marks(marks: Sequence[Mark]) -> Iterator[Marker]:
    for index, mark in enumerate(marks):
        height, thickness, colour = LOOKS[mark.look]
        corners = _triangle(mark) if mark.look == "entry" else mark.points
        closed = mark.look in ("region", "entry", "exit")
        points = xyz_rows(np.concatenate((corners, corners[:1])) if closed else corners, height)
        yield Marker(f"{mark.kind}s", index, LINE_STRIP, (thickness, 0.0, 0.0), colour, points)
        x, y = corners.mean(axis=0) if closed else corners[-1]
        yield Marker(
            f"{mark.kind}_names", index, TEXT_VIEW_FACING, (0.0, 0.0, 0.05), colour, position=(x, y, 0.15),
            text=mark.name,
        )  # fmt: skip


def _triangle(mark: Mark) -> NDArray[np.float64]:
    """Return the corners (3, 2) of an entry: its tip is where bottles appear, and points in their direction."""
    ahead = np.array([math.cos(mark.direction), math.sin(mark.direction)])
    left = np.array([-ahead[1], ahead[0]])
    base = mark.points[0] - ENTRY_SIZE * ahead
    return np.stack([mark.points[0], base + 0.5 * ENTRY_SIZE * left, base - 0.5 * ENTRY_SIZE * left])

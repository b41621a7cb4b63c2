# SPDX-License-Identifier: Apache-2.0
"""Constant arrays of the plant for the engine: rail pieces with their joints, surfaces, the static grid."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.lists import BottleList, StaticGrid
from conveyor_sim.engine.arrays.rails import Arcs, Ends, Segments
from conveyor_sim.engine.arrays.support import Belts, Sectors
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.lists.static_grid import build_static_grid
from conveyor_sim.engine.rails.joint import ANSWERS, FREE, SILENT
from conveyor_sim.engine.support.sector import BEYOND_HALF, FULL_CIRCLE, UP_TO_HALF
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.physics.plant import JOINT_TOLERANCE
from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.geometry import ArcPiece, BeltShape, Piece, RailShape, SegmentPiece, is_full_turn
from conveyor_sim.scene.overlaps import near_pieces, overlapping


@dataclass(frozen=True)
class Joints:
    """Joints at the ends of n rail pieces, (n, 2), start and end of each."""

    code: NDArray[np.int8]
    """FREE, ANSWERS or SILENT."""
    neighbour: NDArray[np.float64]
    """(n, 2, 2), unit vector from a joint into the neighbouring piece."""
    surface: NDArray[np.uint32]
    """(n,), equal for pieces of one surface."""


def find_joints(pieces: Sequence[Piece], inward: NDArray[np.float64]) -> Joints:
    """Join n rail pieces.

    inward: (n, 2, 2), unit vectors from each end into its piece. Where two ends meet, the first piece handles contacts
    of the point. Where more than two ends meet, or an end lies on another piece, ends stay free. Their pieces form one
    surface, in which `share_overlaps` makes the point push once.
    """
    ends = np.array([piece.ends for piece in pieces])
    code = np.full((len(pieces), 2), FREE, dtype=np.int8)
    neighbour = np.zeros((len(pieces), 2, 2))
    parent = list(range(len(pieces)))

    def root(piece: int) -> int:
        while parent[piece] != piece:
            piece = parent[piece]
        return piece

    def unite(piece: int, other: int) -> None:
        low, high = sorted((root(piece), root(other)))
        parent[high] = low

    for piece, other in _ends_on_pieces(pieces, ends):
        unite(piece, other)
    for meeting in _meeting_ends(ends):
        if len(meeting) == 2:
            (a, end_a), (b, end_b) = meeting
            code[a, end_a], code[b, end_b] = ANSWERS, SILENT
            neighbour[a, end_a] = inward[b, end_b]
            neighbour[b, end_b] = inward[a, end_a]
    surface = np.array([root(piece) for piece in range(len(pieces))], dtype=np.uint32)
    return Joints(code=code, neighbour=neighbour, surface=surface)


def _ends_on_pieces(pieces: Sequence[Piece], ends: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return pairs (piece, other) where an end of `other` lies on `piece`."""
    pairs: list[tuple[int, int]] = []
    for index, near, apart in near_pieces(ends.reshape(-1, 2), pieces, JOINT_TOLERANCE):
        touching = np.unique(near[apart <= JOINT_TOLERANCE] // 2)
        pairs.extend((index, other) for other in touching.tolist() if other != index)
    return pairs


def _meeting_ends(ends: NDArray[np.float64]) -> list[list[tuple[int, int]]]:
    """Return groups of two or more (piece, end) that share a point."""
    points = ends.reshape(-1, 2)
    near: dict[int, list[int]] = {}
    for one, other in zip(*overlapping(points, np.full(len(points), JOINT_TOLERANCE / 2), 0.0), strict=True):
        near.setdefault(int(one), []).append(int(other))
        near.setdefault(int(other), []).append(int(one))
    taken: set[int] = set()
    groups = []
    for index in sorted(near, key=lambda end: (points[end, 0], end)):
        if index in taken:
            continue
        group = [index, *(other for other in near[index] if other not in taken)]
        if len(group) > 1:
            taken.update(group)
            groups.append(sorted((flat // 2, flat % 2) for flat in group))
    return groups


STRAIGHT = -1


def reach_code(span: float) -> int:
    """Return the code by which the engine tests if an angle is inside a span (engine/support/sector.py)."""
    if is_full_turn(span):
        return FULL_CIRCLE
    return UP_TO_HALF if span <= math.pi else BEYOND_HALF


def rail_arrays(rails: Sequence[RailShape], materials: Sequence[str]) -> tuple[Segments | None, Arcs | None]:
    """Return straight and arc pieces of all rails, joined into surfaces; None for an absent kind."""
    pieces = [(piece, index) for index, rail in enumerate(rails) for piece in rail.pieces]
    pieces.sort(key=lambda entry: isinstance(entry[0], ArcPiece))
    if not pieces:
        return None, None
    joints = find_joints([piece for piece, _ in pieces], np.array([_inward(piece) for piece, _ in pieces]))
    straight = sum(isinstance(piece, SegmentPiece) for piece, _ in pieces)
    rail = np.array([index for _, index in pieces], dtype=np.uint32)
    material = np.array([materials.index(rails[index].material) for _, index in pieces], dtype=np.uint32)
    first, rest = slice(0, straight), slice(straight, len(pieces))
    segments = arcs = None
    if straight:
        lines = [piece for piece, _ in pieces if isinstance(piece, SegmentPiece)]
        start, end = np.array([line.p1 for line in lines]), np.array([line.p2 for line in lines])
        length = np.hypot(*(end - start).T)
        tangent = (end - start) / length[:, None]
        segments = Segments(
            x=start[:, 0].copy(),
            y=start[:, 1].copy(),
            tx=tangent[:, 0].copy(),
            ty=tangent[:, 1].copy(),
            length=length,
            ends=_ends(start, end, joints, first),
            material=material[first],
            rail=rail[first],
            surface=joints.surface[first],
        )
    if straight < len(pieces):
        curves = [piece for piece, _ in pieces if isinstance(piece, ArcPiece)]
        centre, ends = np.array([curve.centre for curve in curves]), np.array([curve.ends for curve in curves])
        start_angle = np.array([curve.start_angle for curve in curves])
        end_angle = start_angle + np.array([curve.span for curve in curves])
        arcs = Arcs(
            x=centre[:, 0].copy(),
            y=centre[:, 1].copy(),
            radius=np.array([curve.radius for curve in curves]),
            start_x=np.cos(start_angle),
            start_y=np.sin(start_angle),
            end_x=np.cos(end_angle),
            end_y=np.sin(end_angle),
            reach=np.array([reach_code(curve.span) for curve in curves], dtype=np.int8),
            ends=_ends(ends[:, 0], ends[:, 1], joints, rest),
            material=material[rest],
            rail=rail[rest],
            surface=joints.surface[rest],
        )
    return segments, arcs


def belt_arrays(shapes: Sequence[BeltShape], slots: int, candidates: int) -> Belts | None:
    """Return the geometry of surfaces, and arrays for the surface under each of `slots` bottles; None: no surfaces."""
    if not shapes:
        return None
    along = np.array([unit_vector(shape.angle) for shape in shapes])
    corner = np.array([shape.corner for shape in shapes])
    return Belts(
        x=corner[:, 0].copy(),
        y=corner[:, 1].copy(),
        ax=along[:, 0].copy(),
        ay=along[:, 1].copy(),
        length=np.array([shape.length for shape in shapes]),
        width=np.array([shape.width for shape in shapes]),
        sectors=_sectors(shapes) if any(shape.kind == "curved" for shape in shapes) else None,
        certain=np.full(slots, len(shapes), dtype=np.int32),
        start=np.zeros(slots + 1, dtype=np.uint32),
        candidate=np.zeros(candidates, dtype=np.uint32),
        uncertain=listed(slots),
    )


def listed(slots: int) -> BottleList:
    """Return an empty list of bottles by unit."""
    return BottleList(np.zeros(slots, np.uint32), np.zeros(slots // UNIT + 2, np.uint32))


def plant_grid(
    rails: Sequence[RailShape],
    surfaces: Sequence[BeltShape],
    sweeps: Sequence[F8],
    largest_radius: float,
    largest_base_radius: float,
    skin: float,
) -> StaticGrid | None:
    """Build the static grid over all rails, surfaces and sweeps of bodies; return None without any.

    sweeps: boxes, (4,) each: least x and y, greatest x and y, m.
    """
    if not rails and not surfaces and not sweeps:
        return None
    pieces = [piece for rail in rails for piece in rail.pieces]
    return build_static_grid(
        _boxes([piece.points(2) for piece in pieces if isinstance(piece, SegmentPiece)]),
        _boxes([_arc_extremes(piece) for piece in pieces if isinstance(piece, ArcPiece)]),
        _boxes([_surface_extremes(shape) for shape in surfaces]),
        np.array(sweeps).reshape(-1, 4),
        rail_reach=largest_radius + skin,
        belt_reach=skin + largest_base_radius,
        cell=4.0 * largest_radius,
    )


def _sectors(shapes: Sequence[BeltShape]) -> Sectors:
    centre = np.array([shape.centre for shape in shapes])
    inner = np.array([shape.inner_radius for shape in shapes])
    start = np.array([unit_vector(shape.start_angle) for shape in shapes])
    end = np.array([unit_vector(shape.start_angle + shape.span) for shape in shapes])
    reach = [reach_code(shape.span) if shape.kind == "curved" else STRAIGHT for shape in shapes]
    return Sectors(
        x=centre[:, 0].copy(),
        y=centre[:, 1].copy(),
        inner=inner,
        outer=inner + np.array([shape.width for shape in shapes]),
        start_x=start[:, 0].copy(),
        start_y=start[:, 1].copy(),
        end_x=end[:, 0].copy(),
        end_y=end[:, 1].copy(),
        reach=np.array(reach, dtype=np.int8),
    )


def _ends(start: F8, end: F8, joints: Joints, part: slice) -> Ends:
    return Ends(
        x=np.column_stack([start[:, 0], end[:, 0]]),
        y=np.column_stack([start[:, 1], end[:, 1]]),
        joint=joints.code[part],
        neighbour_x=joints.neighbour[part, :, 0].copy(),
        neighbour_y=joints.neighbour[part, :, 1].copy(),
    )


def _inward(piece: Piece) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the unit vectors from each end into the piece."""
    if isinstance(piece, SegmentPiece):
        dx, dy = piece.p2[0] - piece.p1[0], piece.p2[1] - piece.p1[1]
        length = math.hypot(dx, dy)
        return (dx / length, dy / length), (-dx / length, -dy / length)
    start, end = piece.start_angle, piece.start_angle + piece.span
    return (-math.sin(start), math.cos(start)), (math.sin(end), -math.cos(end))


def _arc_extremes(piece: ArcPiece) -> F8:
    """Return points whose bounding box holds the arc: its ends and its crossings with the axes through its centre."""
    first = math.ceil(piece.start_angle / (math.pi / 2))
    last = math.floor((piece.start_angle + piece.span) / (math.pi / 2))
    crossings = np.arange(first, last + 1) * (math.pi / 2)
    angle = np.array([piece.start_angle, piece.start_angle + piece.span, *crossings])
    return np.array(piece.centre) + piece.radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _surface_extremes(shape: BeltShape) -> F8:
    if shape.kind == "straight":
        return shape.outline()
    outer = ArcPiece(shape.centre, shape.inner_radius + shape.width, shape.start_angle, shape.span)
    inner = ArcPiece(shape.centre, shape.inner_radius, shape.start_angle, shape.span)
    return np.concatenate([_arc_extremes(outer), _arc_extremes(inner)])


def _boxes(groups: Sequence[NDArray[np.float64]]) -> F8:
    if not groups:
        return np.empty((0, 4))
    return np.array([[*points.min(axis=0), *points.max(axis=0)] for points in groups])

# SPDX-License-Identifier: Apache-2.0
"""Initial arrays of bodies and their axes, and their largest speed in a tick."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.moving import (
    PHASES,
    UNLIMITED,
    Actuators,
    CamMotion,
    CamTable,
    Clusters,
    MovingBodies,
    MovingSprings,
    Pose,
)
from conveyor_sim.engine.arrays.rails import Arcs, Segments
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.rails.poses import fastest_point
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.physics.model.cluster_sectors import cluster_sectors
from conveyor_sim.physics.model.plant_arrays import rail_arrays
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.bodies import BodyShape, Cam, bounding_circle, moved_piece
from conveyor_sim.scene.geometry import ArcPiece, Piece, RailShape, SegmentPiece

ROUNDING = 1e-9
"""m; circles around pieces are larger by this length, so that rounding can't hide a contact."""


def moving_arrays(plant: Plant, surface: int, slots: int, ledger: bool, springs: bool) -> MovingBodies:
    """Return the arrays of bodies with their axes at rest in their initial positions. Each body is one surface.

    surface: number of the first body's surface. slots: bottle slots. ledger: True if the energy ledger is on. springs:
    True if contacts have tangential springs, or a history.
    """
    shapes, axes = plant.moving, plant.axes
    names = [axis.name for axis in axes]
    position = np.array([axis.first for axis in axes])
    course = np.zeros((len(axes), PHASES, 4))
    course[:, :, 1] = position[:, None]
    pivot, along = np.array([shape.pivot for shape in shapes]), np.array([shape.along for shape in shapes])
    pieces = ordered_pieces(shapes)
    segments, arcs = _pieces(plant, surface)
    home_segments, _ = _pieces(plant, surface)
    clusters, first_cluster = _clusters(shapes), _starts([len(shape.groups) for shape in shapes])
    types = plant.scene.bottle_types
    moves = any(shape.surface_speed is not None for shape in shapes)
    return MovingBodies(
        position=position,
        speed=np.zeros(len(axes)),
        course=course,
        clock=np.zeros(1),
        resting=np.ones(len(axes), np.int8),
        active=np.zeros(len(axes), np.int32),
        actives=np.zeros(1, np.int64),
        axis=np.array([names.index(shape.axis) if shape.axis else -1 for shape in shapes], np.int32),
        lag=np.array([shape.lag for shape in shapes]),
        pivot_x=pivot[:, 0].copy(),
        pivot_y=pivot[:, 1].copy(),
        along_x=along[:, 0].copy(),
        along_y=along[:, 1].copy(),
        turning=np.array([shape.turning for shape in shapes]),
        account=np.array(plant.machine_of_body, np.int32),
        sweep=np.array(plant.sweeps),
        surface_speed=np.array([shape.surface_speed or 0.0 for shape in shapes]) if moves else None,
        loaded=np.zeros(len(axes), np.int8),
        is_near=np.zeros(len(shapes), np.int8),
        near=np.zeros(len(shapes), np.int32),
        nears=np.zeros(1, np.int64),
        first_cluster=first_cluster,
        body=np.array([b for b, _ in pieces], np.int32),
        clusters=clusters,
        sectors=cluster_sectors(clusters, first_cluster, max(kind.radius for kind in types.values())),
        home_segments=home_segments,
        segments=segments,
        arcs=arcs,
        pose=_pose(len(shapes)),
        cams=_cams(shapes),
        actuators=_actuators(plant, slots, ledger),
        springs=_springs(shapes, pieces, slots) if springs else None,
    )


def ordered_pieces(shapes: Sequence[BodyShape]) -> list[tuple[int, int]]:
    """Return body and index of all pieces, cluster by cluster; straight pieces come first."""
    pieces = [(b, index) for b, shape in enumerate(shapes) for group in shape.groups for index in group]
    return sorted(pieces, key=lambda entry: isinstance(shapes[entry[0]].pieces[entry[1]], ArcPiece))


def _pieces(plant: Plant, surface: int) -> tuple[Segments | None, Arcs | None]:
    """Return the pieces of all bodies relative to their pivots, joined body by body."""
    straight: list[Segments] = []
    bent: list[Arcs] = []
    first = len(plant.rails_at_rest)
    for b, shape in enumerate(plant.moving):
        back = (-shape.pivot[0], -shape.pivot[1])
        pieces = [moved_piece(shape.pieces[index], (0.0, 0.0), back, 0.0) for group in shape.groups for index in group]
        segments, arcs = rail_arrays([RailShape(shape.name, shape.material, tuple(pieces))], plant.rail_materials)
        for group in (segments, arcs):
            if group is not None:
                group.rail[:], group.surface[:] = first + plant.machine_of_body[b], surface + b
        straight += [] if segments is None else [_measured(segments, pieces)]
        bent += [] if arcs is None else [arcs]
    return (_joined(straight) if straight else None), (_joined(bent) if bent else None)


def _measured(segments: Segments, pieces: Sequence[Piece]) -> Segments:
    """Return straight pieces with lengths rounded as in recordings of earlier versions, which differ from numpy's."""
    lines = [piece for piece in pieces if isinstance(piece, SegmentPiece)]
    length = np.array([math.dist(line.p1, line.p2) for line in lines])
    tangent = np.array([np.subtract(line.p2, line.p1) for line in lines]) / length[:, None]
    return segments._replace(length=length, tx=tangent[:, 0].copy(), ty=tangent[:, 1].copy())


def _joined(groups: Sequence[Any]) -> Any:
    """Return one group of arrays with the entries of several, one after the other."""
    if isinstance(groups[0], np.ndarray):
        return np.concatenate(groups)
    return type(groups[0])(*(_joined(members) for members in zip(*groups, strict=True)))


def _clusters(shapes: Sequence[BodyShape]) -> Clusters:
    groups = [(shape, [shape.pieces[index] for index in group]) for shape in shapes for group in shape.groups]
    circles = [bounding_circle(pieces) for _, pieces in groups]
    centre = np.array(
        [(x - shape.pivot[0], y - shape.pivot[1]) for (shape, _), ((x, y), _) in zip(groups, circles, strict=True)]
    )
    bent = [sum(isinstance(piece, ArcPiece) for piece in pieces) for _, pieces in groups]
    return Clusters(
        x=centre[:, 0].copy(),
        y=centre[:, 1].copy(),
        radius=np.array([radius for _, radius in circles]) + ROUNDING,
        segment=_starts([len(pieces) - arcs for (_, pieces), arcs in zip(groups, bent, strict=True)]),
        arc=_starts(bent),
    )


def _starts(counts: Sequence[int]) -> NDArray[np.int32]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)


def _pose(count: int) -> Pose:
    return Pose(*(np.zeros(count) for _ in Pose._fields))


def _cams(shapes: Sequence[BodyShape]) -> CamMotion | None:
    if all(shape.cam is None and shape.period is None for shape in shapes):
        return None
    cams: dict[Cam, int] = {}

    def number(cam: Cam | None) -> int:
        return -1 if cam is None else cams.setdefault(cam, len(cams))

    count = len(shapes)
    cam = np.array([number(shape.cam) for shape in shapes], np.int32)
    second = np.array([number(None if shape.slide is None else shape.slide.cam) for shape in shapes], np.int32)
    across = np.array([(0.0, 0.0) if shape.slide is None else shape.slide.direction for shape in shapes])
    parts = np.array([part for one in cams for part in one.parts]).reshape(-1, 4)
    return CamMotion(
        cam=cam,
        second=second,
        across_x=across[:, 0].copy(),
        across_y=across[:, 1].copy(),
        period=np.array([shape.period or 0.0 for shape in shapes]),
        table=CamTable(
            first=_starts([len(one.parts) for one in cams]),
            u=parts[:, 0].copy(),
            s=parts[:, 1].copy(),
            slope=parts[:, 2].copy(),
            curvature=parts[:, 3].copy(),
            end=np.array([one.end for one in cams]),
        ),
        present=np.zeros(count, np.int8),
        rate=np.zeros(count),
        aside=np.zeros(count),
        aside_rate=np.zeros(count),
    )


def _springs(shapes: Sequence[BodyShape], pieces: Sequence[tuple[int, int]], slots: int) -> MovingSprings:
    first = _starts([min(len(shape.pieces), 2) for shape in shapes])
    column = [first[b] + (index % 2 if len(shapes[b].pieces) > 1 else 0) for b, index in pieces]
    return MovingSprings(
        elongation=np.zeros((slots, int(first[-1]))),
        column=np.array(column, np.int32),
        first=first,
        path=np.zeros(len(shapes)),
        aside=np.zeros(len(shapes)),
        elapsed=np.zeros(1),
    )


def _actuators(plant: Plant, slots: int, ledger: bool) -> Actuators | None:
    axes = plant.axes
    if all(axis.limit is None and axis.kind == "position" for axis in axes):
        return None
    count = len(axes)
    first = {shape.axis: machine for shape, machine in zip(plant.moving, plant.machine_of_body, strict=True)}
    return Actuators(
        limit=np.array([UNLIMITED if axis.limit is None else axis.limit for axis in axes]),
        mass=np.array([axis.inertia for axis in axes]),
        max_speed=np.array([axis.max_speed for axis in axes]),
        max_acceleration=np.array([axis.acceleration for axis in axes]),
        low=np.array([0.0 if axis.kind == "position" else -math.inf for axis in axes]),
        stroke=np.array([axis.stroke if axis.kind == "position" else math.inf for axis in axes]),
        account=np.array([first.get(axis.name, 0) for axis in axes], np.int32),
        mode=np.zeros(count, np.int8),
        left=np.zeros(count, np.int8),
        acceleration=np.zeros(count),
        push=np.zeros((-(-slots // UNIT), count, 3 if ledger else 1)),
        load=np.zeros(count),
    )


class FastestRail:
    """Largest speed of any point of the bodies and surfaces of one scene."""

    def __init__(self, plant: Plant) -> None:
        self._reach = plant.reach_of_axes
        self._find: Any = None

    def speed(self, moving: MovingBodies | None) -> float:
        """Return the largest speed (m/s) in this tick without bottles; 0 if nothing moves."""
        if moving is None:
            return 0.0
        self._find = self._find or entry(fastest_point, moving, self._reach)
        surface = 0.0 if moving.surface_speed is None else float(np.abs(moving.surface_speed).max())
        fastest: float = self._find(moving, self._reach)
        return max(surface, fastest)

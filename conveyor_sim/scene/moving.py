# SPDX-License-Identifier: Apache-2.0
"""Moving parts of a scene: its bodies and its axes, in the order of their numbers."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from conveyor_sim.scene.bodies import AxisShape, BodyShape, Cam, moved_piece
from conveyor_sim.scene.cam_table import cam_through
from conveyor_sim.scene.gearing import first_position, top_speed
from conveyor_sim.scene.geometry import Piece, RailShape, SegmentPiece
from conveyor_sim.scene.parts.movers import (
    Clamp,
    Diverter,
    LiftingGate,
    Mover,
    Positioned,
    SlidingDivider,
    SlidingGate,
    SwingingDivider,
    SwingingGate,
)
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import XY
from conveyor_sim.scene.wheel_bodies import wheel_bodies

MOVER_FIELDS = ("gates", "pushers", "diverters", "dividers", "adjustable", "clamps")
"""Fields of a scene with movers, in the order of their rails' numbers."""


def movers_of(scene: Scene) -> Iterator[tuple[Path, Mover]]:
    """Yield every mover with its path, in the order of their rails' numbers."""
    for field in MOVER_FIELDS:
        for name, mover in getattr(scene, field).items():
            yield (field, name), mover


def mover_shape(path: Path, mover: Mover) -> tuple[tuple[BodyShape, ...], AxisShape]:
    """Return the bodies of a mover, which are one machine, and the axis that moves only these bodies.

    A mover with several positions is at home at the least of them. A lifting gate is absent above half of its stroke.
    """
    name = "/".join(str(part) for part in path)
    along, turning, least, stroke, first = _motion(mover)
    shift = along[0] * least, along[1] * least
    pieces: tuple[Piece, ...] = _pieces(mover)
    if least:  # without rounding where there is nothing to move
        pieces = tuple(moved_piece(piece, mover.from_, shift, turning * least) for piece in pieces)
    pivot = mover.from_[0] + shift[0], mover.from_[1] + shift[1]
    body = BodyShape(name, mover.material, pieces, axis=name, pivot=pivot, along=along, turning=turning)
    if isinstance(mover, LiftingGate):
        body = replace(body, cam=Cam(((0.0, 0.0, 0.0, 0.0),), 0.5 * stroke))
    bodies: tuple[BodyShape, ...] = (body,)
    if isinstance(mover, Clamp):
        away = along[0] * mover.opening, along[1] * mover.opening
        opposite = tuple(moved_piece(piece, mover.from_, away, 0.0) for piece in pieces)
        bodies = (body, replace(body, pieces=opposite, along=(-along[0], -along[1])))
    axis = AxisShape(
        name=name,
        kind="position",
        stroke=stroke,
        max_speed=mover.max_speed,
        acceleration=mover.acceleration,
        first=first,
        limit=None if isinstance(mover, LiftingGate) else mover.drive_limit,  # no bottle acts on a lift
        inertia=mover.drive_mass,
    )
    return bodies, axis


def _motion(mover: Mover) -> tuple[XY, float, float, float, float]:
    """Return direction, turning, displacement at home, stroke and initial position."""
    if isinstance(mover, Positioned):
        least = min(mover.positions)
        first = mover.positions[min(mover.index, len(mover.positions) - 1)] - least
        stroke = max(mover.positions) - least
        if isinstance(mover, SwingingDivider):
            return (0.0, 0.0), 1.0, least, stroke, first
        return (math.cos(mover.direction), math.sin(mover.direction)), 0.0, least, stroke, first
    opens = isinstance(mover, (SlidingGate, SwingingGate, LiftingGate)) and mover.open
    if isinstance(mover, (SwingingGate, Diverter)):
        stroke = abs(mover.angle)
        return (0.0, 0.0), math.copysign(1.0, mover.angle), 0.0, stroke, stroke if opens else 0.0
    stroke = mover.stroke
    along = (0.0, 0.0) if isinstance(mover, LiftingGate) else (math.cos(mover.direction), math.sin(mover.direction))
    return along, 0.0, 0.0, stroke, stroke if opens else 0.0


def _pieces(mover: Mover) -> tuple[SegmentPiece, ...]:
    """Return the rail of a mover as its fields place it, or both rails of a divider with a clearance."""
    piece = SegmentPiece(mover.from_, mover.to)
    if not isinstance(mover, (SwingingDivider, SlidingDivider)) or mover.clearance is None:
        return (piece,)
    half = 0.5 * mover.clearance / piece.length
    left = -half * (mover.to[1] - mover.from_[1]), half * (mover.to[0] - mover.from_[0])
    right = -left[0], -left[1]
    return tuple(
        SegmentPiece((mover.from_[0] + x, mover.from_[1] + y), (mover.to[0] + x, mover.to[1] + y))
        for x, y in (right, left)
    )


def bodies_of(scene: Scene) -> list[BodyShape]:
    """Return all bodies. Bodies of one machine follow each other; machines have the rail numbers after rails at rest.

    Those of gates, pushers and diverters come first, then those of star wheels, screws and side belts.
    """
    movers = [body for path, mover in movers_of(scene) for body in mover_shape(path, mover)[0]]
    return [_on_cam(scene, body) for body in (*movers, *wheel_bodies(scene))]


def _on_cam(scene: Scene, body: BodyShape) -> BodyShape:
    """Return a body with the cam of its axis, if that has one."""
    axis = scene.axes.get(body.axis.removeprefix("axes/")) if body.axis.startswith("axes/") else None
    if axis is None or axis.cam is None:
        return body
    cam = cam_through(axis.cam)
    return replace(body, cam=cam, period=cam.end)


def axes_of(scene: Scene) -> list[AxisShape]:
    """Return all axes in the order of their numbers: those of gates, pushers and diverters, then named ones."""
    own = [mover_shape(path, mover)[1] for path, mover in movers_of(scene)]
    return [*own, *(axis_shape(scene, name) for name in scene.axes)]


def axis_shape(scene: Scene, name: str) -> AxisShape:
    """Return a named axis, which has no end stops."""
    axis = scene.axes[name]
    return AxisShape(
        name=f"axes/{name}",
        kind="velocity",
        stroke=math.inf,
        max_speed=top_speed(scene, name) + axis.jog_speed,
        acceleration=axis.acceleration,
        first=first_position(scene, name),
        limit=None if axis.torque_limit == "none" else axis.torque_limit,
        inertia=axis.inertia,
    )


def place_signals(scene: Scene) -> list[str]:
    """Return the names of the signals that state the places of bodies."""
    own = [f"{mover_shape(path, mover)[1].name}/position" for path, mover in movers_of(scene)]
    return [*own, *dict.fromkeys(f"{body.name}/angle" for body in wheel_bodies(scene) if body.axis)]


def bodies_by_signals(scene: Scene, value: Callable[[str], float]) -> tuple[RailShape, ...]:
    """Return the bodies that are present, each as a rail, where `place_signals` state that they are.

    Angles of star wheels and screws contain slip on their shafts and cams of their axes. value: returns the value of
    a signal.
    """
    shapes, first = [], dict[str, float]()
    for path, mover in movers_of(scene):
        bodies, axis = mover_shape(path, mover)
        shapes += [body.shape(axis.position(value(f"{axis.name}/position"))) for body in bodies]
    for body in wheel_bodies(scene):
        lag = first.setdefault(body.name, body.lag)
        shapes.append(body.shape(lag + value(f"{body.name}/angle") if body.axis else 0.0))
    return tuple(shape for shape in shapes if shape.pieces)


def bodies_at(bodies: Iterable[BodyShape], positions: Mapping[str, float]) -> tuple[RailShape, ...]:
    """Return the bodies that are present, each as a rail, at positions (m or rad) of their axes, by name."""
    shapes = (shape.shape(positions.get(shape.axis, 0.0)) for shape in bodies)
    return tuple(shape for shape in shapes if shape.pieces)

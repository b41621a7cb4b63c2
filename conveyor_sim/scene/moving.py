# SPDX-License-Identifier: Apache-2.0
"""Moving parts of a scene: its bodies and its axes, in the order of their numbers."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from conveyor_sim.scene.bodies import AxisShape, BodyShape, moved_piece
from conveyor_sim.scene.gearing import first_position, top_speed
from conveyor_sim.scene.geometry import RailShape, SegmentPiece
from conveyor_sim.scene.parts.movers import Diverter, Mover, Positioned, Pusher, SwingingDivider, SwingingGate
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene

MOVER_FIELDS = ("gates", "pushers", "diverters", "dividers", "adjustable")
"""Fields of a scene with movers, in the order of their rails' numbers."""


def movers_of(scene: Scene) -> Iterator[tuple[Path, Mover]]:
    """Yield every mover with its path, in the order of their rails' numbers."""
    for field in MOVER_FIELDS:
        for name, mover in getattr(scene, field).items():
            yield (field, name), mover


def mover_shape(path: Path, mover: Mover) -> tuple[BodyShape, AxisShape]:
    """Return the straight rail of a mover, and the axis that moves only this rail."""
    if isinstance(mover, Positioned):
        return _positioned_body(path, mover)
    if isinstance(mover, (SwingingGate, Diverter)):
        along, turning, stroke = (0.0, 0.0), math.copysign(1.0, mover.angle), abs(mover.angle)
    else:
        along, turning, stroke = (math.cos(mover.direction), math.sin(mover.direction)), 0.0, mover.stroke
    starts_open = not isinstance(mover, (Pusher, Diverter)) and mover.open
    name = "/".join(str(part) for part in path)
    piece = SegmentPiece(mover.from_, mover.to)
    body = BodyShape(name, mover.material, (piece,), axis=name, pivot=mover.from_, along=along, turning=turning)
    axis = AxisShape(
        name=name,
        kind="position",
        stroke=stroke,
        max_speed=mover.max_speed,
        acceleration=mover.acceleration,
        first=stroke if starts_open else 0.0,
        limit=mover.drive_limit,
        inertia=mover.drive_mass,
    )
    return body, axis


def _positioned_body(path: Path, mover: Positioned) -> tuple[BodyShape, AxisShape]:
    """Return the rail of a mover with several positions, and its axis. It is at home at the least position."""
    least, greatest = min(mover.positions), max(mover.positions)
    if isinstance(mover, SwingingDivider):
        along, turning = (0.0, 0.0), 1.0
    else:
        along, turning = (math.cos(mover.direction), math.sin(mover.direction)), 0.0
    name = "/".join(str(part) for part in path)
    shift = along[0] * least, along[1] * least
    piece = moved_piece(SegmentPiece(mover.from_, mover.to), mover.from_, shift, turning * least)
    body = BodyShape(name, mover.material, (piece,), axis=name, pivot=piece.ends[0], along=along, turning=turning)
    axis = AxisShape(
        name=name,
        kind="position",
        stroke=greatest - least,
        max_speed=mover.max_speed,
        acceleration=mover.acceleration,
        first=mover.positions[min(mover.index, len(mover.positions) - 1)] - least,
        limit=mover.drive_limit,
        inertia=mover.drive_mass,
    )
    return body, axis


def bodies_of(scene: Scene) -> list[BodyShape]:
    """Return all bodies. Bodies of one machine follow each other; machines have the rail numbers after rails at rest.

    Those of gates, pushers and diverters come first.
    """
    return [mover_shape(path, mover)[0] for path, mover in movers_of(scene)]


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


def positions_of(axes: Sequence[AxisShape], value: Callable[[str], float]) -> dict[str, float]:
    """Return the position (m or rad) of each axis, by name. value: returns the value of a signal."""
    return {axis.name: axis.position(value(f"{axis.name}/position")) for axis in axes}


def bodies_at(bodies: Iterable[BodyShape], positions: Mapping[str, float]) -> tuple[RailShape, ...]:
    """Return the bodies that are present, each as a rail, at positions (m or rad) of their axes, by name."""
    shapes = (shape.shape(positions.get(shape.axis, 0.0)) for shape in bodies)
    return tuple(shape for shape in shapes if shape.pieces)

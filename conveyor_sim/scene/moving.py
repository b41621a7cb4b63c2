# SPDX-License-Identifier: Apache-2.0
"""Shapes of moving rails at a position of their stroke. Pure functions; m and rad."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from conveyor_sim.scene.bodies import AxisShape, BodyShape
from conveyor_sim.scene.gearing import first_position, top_speed
from conveyor_sim.scene.geometry import Array, RailShape, SegmentPiece
from conveyor_sim.scene.parts.movers import Diverter, Mover, Positioned, Pusher, SwingingDivider, SwingingGate
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import XY

MOVER_FIELDS = ("gates", "pushers", "diverters", "dividers", "adjustable")
"""Fields of a scene with movers, in the order of their rails' numbers."""


@dataclass(frozen=True)
class MovingShape:
    """A straight rail from `start` to `end` at home, which slides along a direction or swings about its start."""

    name: str
    """Name such as `gates/exit`."""
    material: str
    start: XY
    end: XY
    along: XY
    """Unit vector along which it slides, (0, 0) if it swings."""
    turning: float
    """1 swings counter-clockwise, -1 clockwise; 0 slides."""
    stroke: float
    """Largest position, m or rad; 0 is home."""
    max_speed: float
    """m/s, or rad/s."""
    acceleration: float
    """m/s^2, or rad/s^2."""
    first: float
    """Position at the beginning of the run."""
    limit: float | None
    """Largest force or torque of its drive, N or N m; None without limit."""
    mass: float
    """kg, or kg m^2 about its start."""

    @property
    def length(self) -> float:
        """Length of the rail, m."""
        return math.dist(self.start, self.end)

    @property
    def fastest_point(self) -> float:
        """Path of its fastest point per change of position."""
        return self.length if self.turning else 1.0

    def at(self, position: float) -> SegmentPiece:
        """Return the rail at a position (m or rad)."""
        (x, y), (dx, dy) = self.start, (self.end[0] - self.start[0], self.end[1] - self.start[1])
        x, y = x + self.along[0] * position, y + self.along[1] * position
        cos, sin = math.cos(self.turning * position), math.sin(self.turning * position)
        return SegmentPiece((x, y), (x + dx * cos - dy * sin, y + dx * sin + dy * cos))

    def sweep(self) -> Array:
        """Return the box of all its places, (4,): least x and y, greatest x and y."""
        places = [0.0, self.stroke]
        if self.turning:
            # Its end is farthest along an axis where it crosses the axis.
            home = math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])
            crossings = (self.turning * (quarter * math.pi / 2.0 - home) for quarter in range(-12, 13))
            places += [place for place in crossings if 0.0 < place < self.stroke]
        points = np.concatenate([self.at(place).points() for place in places])
        return np.concatenate([points.min(axis=0), points.max(axis=0)])

    def shape(self, position: float) -> RailShape:
        """Return the rail at a position (m or rad) as a RailShape."""
        return RailShape(self.name, self.material, (self.at(position),))


def movers_of(scene: Scene) -> Iterator[tuple[Path, Mover]]:
    """Yield every mover with its path, in the order of their rails' numbers."""
    for field in MOVER_FIELDS:
        for name, mover in getattr(scene, field).items():
            yield (field, name), mover


def moving_shape(path: Path, mover: Mover) -> MovingShape:
    """Return the shape of a mover."""
    if isinstance(mover, Positioned):
        return _positioned_shape(path, mover)
    if isinstance(mover, (SwingingGate, Diverter)):
        along, turning, stroke = (0.0, 0.0), math.copysign(1.0, mover.angle), abs(mover.angle)
    else:
        along, turning, stroke = (math.cos(mover.direction), math.sin(mover.direction)), 0.0, mover.stroke
    starts_open = not isinstance(mover, (Pusher, Diverter)) and mover.open
    return MovingShape(
        name="/".join(str(part) for part in path),
        material=mover.material,
        start=mover.from_,
        end=mover.to,
        along=along,
        turning=turning,
        stroke=stroke,
        max_speed=mover.max_speed,
        acceleration=mover.acceleration,
        first=stroke if starts_open else 0.0,
        limit=mover.drive_limit,
        mass=mover.drive_mass,
    )


def _positioned_shape(path: Path, mover: Positioned) -> MovingShape:
    """Return the shape of a mover with several positions. It is at home at the least of them."""
    least, greatest = min(mover.positions), max(mover.positions)
    if isinstance(mover, SwingingDivider):
        along, turning = (0.0, 0.0), 1.0
    else:
        along, turning = (math.cos(mover.direction), math.sin(mover.direction)), 0.0
    zero = MovingShape(
        name="/".join(str(part) for part in path),
        material=mover.material,
        start=mover.from_,
        end=mover.to,
        along=along,
        turning=turning,
        stroke=greatest - least,
        max_speed=mover.max_speed,
        acceleration=mover.acceleration,
        first=mover.positions[min(mover.index, len(mover.positions) - 1)] - least,
        limit=mover.drive_limit,
        mass=mover.drive_mass,
    )
    home = zero.at(least)
    return replace(zero, start=home.p1, end=home.p2)


def moving_shapes(scene: Scene) -> list[MovingShape]:
    """Return the moving rails. Their numbers follow those of the rails at rest."""
    return [moving_shape(path, mover) for path, mover in movers_of(scene)]


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
    shape = _positioned_shape(path, mover)
    piece = SegmentPiece(shape.start, shape.end)
    body = BodyShape(
        shape.name,
        shape.material,
        (piece,),
        axis=shape.name,
        pivot=shape.start,
        along=shape.along,
        turning=shape.turning,
    )
    axis = AxisShape(
        name=shape.name,
        kind="position",
        stroke=shape.stroke,
        max_speed=shape.max_speed,
        acceleration=shape.acceleration,
        first=shape.first,
        limit=shape.limit,
        inertia=shape.mass,
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

"""Surfaces that carry bottles: places, directions of travel and speeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.driven import belt_speeds, speed_limits
from conveyor_sim.scene.geometry import Array, BeltShape, is_full_turn, surface_shapes
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import TOUCH, XY

NOMINAL_SPEED = 0.2
"""m/s, assumed speed of belts that stand at the start, because a controller will run them."""

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

NONE = -1
"""Index that stands for no surface."""


@dataclass(frozen=True)
class FlowSurface:
    """A surface of a belt, or a plate."""

    name: str
    path: Path
    """Path of its belt or plate in the scene."""
    shape: BeltShape
    speed: float
    """m/s along its travel at the start; negative backwards, 0 for a plate."""
    running: float
    """m/s in a trace along the angle of its shape, or counter-clockwise. A belt that stands has a nominal speed."""

    def contains(self, points: Array) -> Mask:
        """Return True for points (k, 2) on the surface, (k,)."""
        shape = self.shape
        if shape.kind == "straight":
            along, across = _straight_coordinates(shape, points)
            return np.logical_and(_within(along, shape.length), _within(across, shape.width))
        seen = points - np.array(shape.centre)
        radius = np.hypot(seen[:, 0], seen[:, 1])
        inside = _within(radius - shape.inner_radius, shape.width)
        if is_full_turn(shape.span):
            return inside
        turned = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - shape.start_angle + TOUCH, 2.0 * math.pi)
        within: Mask = inside & (turned <= shape.span + 2.0 * TOUCH)
        return within

    def heading(self, points: Array) -> Array:
        """Return unit vectors (k, 2) of the motion at points."""
        shape = self.shape
        if shape.kind == "straight":
            positive = np.tile([math.cos(shape.angle), math.sin(shape.angle)], (len(points), 1))
        else:
            seen = points - np.array(shape.centre)
            radius = np.maximum(np.hypot(seen[:, 0], seen[:, 1]), TOUCH)
            positive = np.column_stack([-seen[:, 1], seen[:, 0]]) / radius[:, None]
        return -positive if self.running < 0.0 else positive

    @property
    def middle(self) -> Array:
        """Points along the middle in the direction of motion, (k, 2)."""
        line = self.shape.centre_line(2 if self.shape.kind == "straight" else 33)
        return line[::-1] if self.speed < 0.0 else line

    @property
    def rests(self) -> bool:
        """True for a plate."""
        return self.path[0] == "plates"


def surfaces_of(scene: Scene) -> tuple[FlowSurface, ...]:
    """Return the surfaces of a scene: those of belts in order, then plates. Where they overlap, the last one carries.

    They have the names of their conveyors where there is a layout, else those of their belts or plates.
    """
    speeds, running = belt_speeds(scene), running_speeds(scene)
    belts, names = list(scene.belts), _conveyors(scene)
    surfaces = []
    for shape in surface_shapes(scene):
        if shape.belt is None:
            surfaces.append(FlowSurface(shape.name, ("plates", shape.name), shape, 0.0, 0.0))
            continue
        belt = belts[shape.belt]
        sense = -shape.ratio if shape.clockwise else shape.ratio
        surface = FlowSurface(
            names.get(belt, belt), ("belts", belt), shape, shape.ratio * speeds[belt], sense * running[belt]
        )
        surfaces.append(surface)
    return tuple(surfaces)


def _conveyors(scene: Scene) -> dict[str, str]:
    """Return the conveyor of each belt in a layout, by belt; belts of sections keep their names."""
    conveyors = {} if scene.layout is None else scene.layout.conveyors
    return {belt: name for name, plan in conveyors.items() for belt in plan.belts if len(plan.belts) == 1}


def running_speeds(scene: Scene) -> dict[str, float]:
    """Return the speed of each belt in a trace, m/s, by name.

    It is the speed at the start. A belt that stands then has a nominal speed within its limits.
    """
    speeds = belt_speeds(scene)
    for name, speed in speeds.items():
        if speed == 0.0:
            least, greatest = speed_limits(scene, name)
            speeds[name] = min(max(NOMINAL_SPEED, least), greatest)
    return speeds


def under(surfaces: Sequence[FlowSurface], points: Array) -> Indices:
    """Return the index of the surface that carries each of some points (k, 2), or NONE, (k,)."""
    carrier = np.full(len(points), NONE, dtype=np.intp)
    for index, surface in enumerate(surfaces):
        carrier[surface.contains(points)] = index
    return carrier


def surface_at(surfaces: Sequence[FlowSurface], point: XY) -> FlowSurface | None:
    """Return the surface that carries a point, or None."""
    index = int(under(surfaces, np.array([point]))[0])
    return None if index == NONE else surfaces[index]


def _straight_coordinates(shape: BeltShape, points: Array) -> tuple[Array, Array]:
    cos, sin = math.cos(shape.angle), math.sin(shape.angle)
    x, y = (points - np.array(shape.corner)).T
    return cos * x + sin * y, cos * y - sin * x


def _within(value: Array, most: float) -> Mask:
    within: Mask = (value >= -TOUCH) & (value <= most + TOUCH)
    return within

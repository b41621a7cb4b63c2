"""Surfaces that carry bottles: places, directions of travel and speeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from conveyor_sim.scene.geometry import Array, BeltShape, belt_shapes, is_full_turn
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import TOUCH, XY

NOMINAL_SPEED = 0.2
"""m/s, assumed speed of belts that stand at the start, because a controller will run them."""

NONE = -1
"""Index that stands for no surface."""


@dataclass(frozen=True)
class Surface:
    """A belt as bottles see it."""

    name: str
    path: Path
    """Path of its belt in the scene."""
    shape: BeltShape
    speed: float
    """m/s along its travel; negative backwards."""
    material: str

    def contains(self, points: Array) -> np.ndarray:
        """Return True for points (k, 2) on the surface, (k,)."""
        shape = self.shape
        if shape.kind == "straight":
            along, across = _straight_coordinates(shape, points)
            return _within(along, shape.length) & _within(across, shape.width)
        seen = points - np.array(shape.centre)
        radius = np.hypot(seen[:, 0], seen[:, 1])
        inside = _within(radius - shape.inner_radius, shape.width)
        if is_full_turn(shape.span):
            return inside
        turned = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - shape.start_angle + TOUCH, 2.0 * math.pi)
        return inside & (turned <= shape.span + 2.0 * TOUCH)

    def heading(self, points: Array) -> Array:
        """Return unit vectors (k, 2) of the actual motion at points; of positive travel if the belt stands."""
        shape = self.shape
        if shape.kind == "straight":
            positive = np.tile([math.cos(shape.angle), math.sin(shape.angle)], (len(points), 1))
        else:
            seen = points - np.array(shape.centre)
            radius = np.maximum(np.hypot(seen[:, 0], seen[:, 1]), TOUCH)
            positive = np.column_stack([-seen[:, 1], seen[:, 0]]) / radius[:, None]
        return -positive if self.speed < 0.0 else positive

    @property
    def middle(self) -> Array:
        """Points along the middle in the direction of actual motion, (k, 2)."""
        line = self.shape.centre_line(2 if self.shape.kind == "straight" else 33)
        return line[::-1] if self.speed < 0.0 else line


def surfaces_of(scene: Scene) -> tuple[Surface, ...]:
    """Return the surfaces of a scene in the order of its belts. Where they overlap, the last one carries."""
    shapes = belt_shapes(scene)
    return tuple(
        Surface(name, ("belts", name), shape, belt.speed, belt.material)
        for (name, belt), shape in zip(scene.belts.items(), shapes, strict=True)
    )


def running(surface: Surface, limits: tuple[float, float]) -> float:
    """Return the speed of a belt in a trace: the speed at the start, or a nominal one within its limits if it stands."""
    if surface.speed != 0.0:
        return surface.speed
    return min(max(NOMINAL_SPEED, limits[0]), limits[1])


def under(surfaces: Sequence[Surface], points: Array) -> np.ndarray:
    """Return the index of the surface that carries each of some points (k, 2), or NONE, (k,)."""
    carrier = np.full(len(points), NONE)
    for index, surface in enumerate(surfaces):
        carrier[surface.contains(points)] = index
    return carrier


def surface_at(surfaces: Sequence[Surface], point: XY) -> Surface | None:
    """Return the surface that carries a point, or None."""
    index = int(under(surfaces, np.array([point]))[0])
    return None if index == NONE else surfaces[index]


def _straight_coordinates(shape: BeltShape, points: Array) -> tuple[Array, Array]:
    cos, sin = math.cos(shape.angle), math.sin(shape.angle)
    x, y = (points - np.array(shape.corner)).T
    return cos * x + sin * y, cos * y - sin * x


def _within(value: Array, most: float) -> np.ndarray:
    return (value >= -TOUCH) & (value <= most + TOUCH)

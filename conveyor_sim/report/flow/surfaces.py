# SPDX-License-Identifier: Apache-2.0
"""Surfaces that carry bottles: places, directions of travel and speeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.driven import belt_speeds, speed_limits
from conveyor_sim.scene.geometry import Array, BeltShape, is_full_turn, surface_shapes
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.types import TOUCH

NOMINAL_SPEED = 0.2
"""m/s, assumed speed of belts that stand at the start, because a controller will run them."""

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

_BLOCK = 500
"""Points that are compared at once with the surfaces near them."""

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


class SurfaceMap(Sequence[FlowSurface]):
    """Surfaces by index, with a search for the one under a point. Where they overlap, the last one carries."""

    def __init__(self, surfaces: Sequence[FlowSurface]) -> None:
        self._surfaces = tuple(surfaces)
        outlines = [surface.shape.outline() for surface in surfaces]
        # Chords of 64 points stay within a hundredth of the size inside an arc.
        spare = [
            0.01 * np.ptp(outline, axis=0).max() * (surface.shape.kind == "curved") + TOUCH
            for surface, outline in zip(surfaces, outlines, strict=True)
        ]
        self._low = np.array([o.min(axis=0) - more for o, more in zip(outlines, spare, strict=True)]).reshape(-1, 2)
        self._high = np.array([o.max(axis=0) + more for o, more in zip(outlines, spare, strict=True)]).reshape(-1, 2)

    def __len__(self) -> int:
        return len(self._surfaces)

    @overload
    def __getitem__(self, index: int) -> FlowSurface: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[FlowSurface]: ...

    def __getitem__(self, index: int | slice) -> FlowSurface | Sequence[FlowSurface]:
        return self._surfaces[index]

    def under(self, points: Array) -> Indices:
        """Return the index of the surface that carries each of some points (k, 2), or NONE, (k,)."""
        carrier = np.full(len(points), NONE, dtype=np.intp)
        for first in range(0, len(points), _BLOCK):
            block = points[first : first + _BLOCK]
            low, high = block.min(axis=0), block.max(axis=0)
            near = ((self._low <= high) & (self._high >= low)).all(axis=1)
            for index in np.flatnonzero(near):
                carrier[first : first + _BLOCK][self._surfaces[index].contains(block)] = index
        return carrier


def surfaces_of(scene: Scene) -> SurfaceMap:
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
    return SurfaceMap(surfaces)


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


def _straight_coordinates(shape: BeltShape, points: Array) -> tuple[Array, Array]:
    cos, sin = math.cos(shape.angle), math.sin(shape.angle)
    x, y = (points - np.array(shape.corner)).T
    return cos * x + sin * y, cos * y - sin * x


def _within(value: Array, most: float) -> Mask:
    within: Mask = (value >= -TOUCH) & (value <= most + TOUCH)
    return within

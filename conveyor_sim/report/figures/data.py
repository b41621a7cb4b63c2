# SPDX-License-Identifier: Apache-2.0
"""Input of the drawing functions: plain arrays and shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.damage import RailWearColumns
from conveyor_sim.page.drawings.underlay import ShownUnderlay, shown_underlay
from conveyor_sim.scene.driven import belt_speeds
from conveyor_sim.scene.geometry import BeltShape, RailShape, initial_bottles, rail_shapes, surface_shapes
from conveyor_sim.scene.marks import marks_of
from conveyor_sim.scene.moving import axes_of, bodies_at, bodies_of
from conveyor_sim.scene.parts.device_part import Look, Mark

if TYPE_CHECKING:
    from conveyor_sim.scene import Scene

Floats = NDArray[np.float64]
_OUTLINE_POINTS = 96


@dataclass(frozen=True)
class StaticGeometry:
    """Static geometry: surfaces, initial speeds of belts (m/s), rails in listing order, device markers."""

    surfaces: tuple[BeltShape, ...]
    speeds: Floats
    rails: tuple[RailShape, ...]
    """Rails at rest, then bodies."""
    marks: tuple[Mark, ...] = ()
    underlay: ShownUnderlay | None = None
    resting: int = 0
    """Number of rails at rest."""
    rail_names: tuple[str, ...] = ()
    """Names by rail number: rails at rest, then machines."""

    @classmethod
    def of(cls, scene: Scene) -> StaticGeometry:
        """Return the static geometry of `scene`."""
        underlay, resting, bodies = shown_underlay(scene), rail_shapes(scene), bodies_of(scene)
        return cls(
            surfaces=tuple(surface_shapes(scene)),
            speeds=np.array([*belt_speeds(scene).values()], dtype=np.float64),
            rails=(*resting, *bodies_at(bodies, {axis.name: axis.first for axis in axes_of(scene)})),
            resting=len(resting),
            rail_names=(*(rail.name for rail in resting), *dict.fromkeys(body.name for body in bodies)),
            marks=tuple(marks_of(scene)),
            underlay=underlay if isinstance(underlay, ShownUnderlay) else None,
        )

    def drawn_as(self, look: Look) -> list[Mark]:
        """Return the markers of one look."""
        return [mark for mark in self.marks if mark.look == look]

    def with_moving(self, moving: Sequence[RailShape]) -> StaticGeometry:
        """Return a copy with the bodies at other positions; unchanged without any."""
        return replace(self, rails=(*self.rails[: self.resting], *moving)) if moving else self

    def surface_speeds(self, speeds: Floats) -> Floats:
        """Speeds (surfaces,) along travel in m/s at speeds (belts,) of the belts; 0 for plates."""
        return np.array([0.0 if shape.belt is None else shape.ratio * speeds[shape.belt] for shape in self.surfaces])

    def surface_outline(self, index: int) -> Floats:
        """Outline (k, 2) of surface `index`, m."""
        return np.asarray(self.surfaces[index].outline(_OUTLINE_POINTS), dtype=np.float64)

    def rail_line(self, index: int) -> Floats:
        """Course (k, 2) of rail `index`, m."""
        return np.asarray(self.rails[index].outline(_OUTLINE_POINTS), dtype=np.float64)

    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest box (x0, y0, x1, y1) in m around surfaces, rails and marks."""
        parts = [self.surface_outline(i) for i in range(len(self.surfaces))]
        parts += [self.rail_line(i) for i in range(len(self.rails))]
        parts += [mark.points for mark in self.marks]
        return box_around(np.concatenate(parts)) if parts else (math.inf, math.inf, -math.inf, -math.inf)


@dataclass(frozen=True)
class Contacts:
    """Closed contacts as lines (n, 2, 2) in m, from the bottle's axis to the other's, or to the point on the rail.

    `force` (n,) is the normal force in N.
    """

    lines: Floats = field(default_factory=lambda: np.empty((0, 2, 2)))
    force: Floats = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class PlantFrame:
    """The line at one instant: `time` in s; columns (n,) of bottles in m, rad, m/s; the belts' speeds in m/s.

    `contacts` is None if none were recorded, which is not the same as none being closed.
    """

    time: float
    x: Floats
    y: Floats
    theta: Floats
    radius: Floats
    speed: Floats
    belt_speeds: Floats
    contacts: Contacts | None = None
    moving: tuple[RailShape, ...] = ()
    """Gates, pushers and diverters; none: they are as at first."""

    @classmethod
    def start_of(cls, scene: Scene) -> PlantFrame:
        """Return the initial bottles of `scene`, with all belts at their initial speeds."""
        born = list(initial_bottles(scene))
        state = np.array([row[1:] for row in born], dtype=np.float64).reshape(len(born), 6)
        return cls(
            time=0.0,
            x=state[:, 0],
            y=state[:, 1],
            theta=state[:, 2],
            radius=np.array([scene.bottle_types[row[0]].radius for row in born], dtype=np.float64),
            speed=np.hypot(state[:, 3], state[:, 4]),
            belt_speeds=np.array([*belt_speeds(scene).values()], dtype=np.float64),
        )

    def within(self, box: tuple[float, float, float, float]) -> PlantFrame:
        """Return the frame restricted to a box.

        The result has the bottles that reach into `box` (x0, y0, x1, y1) and the contacts that start in it.
        """
        x0, y0, x1, y1 = box
        keep = (
            (self.x + self.radius >= x0)
            & (self.x - self.radius <= x1)
            & (self.y + self.radius >= y0)
            & (self.y - self.radius <= y1)
        )
        contacts = self.contacts
        if contacts is not None:
            start = contacts.lines[:, 0]
            inside = (start[:, 0] >= x0) & (start[:, 0] <= x1) & (start[:, 1] >= y0) & (start[:, 1] <= y1)
            contacts = Contacts(contacts.lines[inside], contacts.force[inside])
        return PlantFrame(
            self.time,
            self.x[keep],
            self.y[keep],
            self.theta[keep],
            self.radius[keep],
            self.speed[keep],
            self.belt_speeds,
            contacts,
        )


@dataclass(frozen=True)
class Velocity:
    """Velocity of one bottle over time: `time` s, `vx` and `vy` m/s, `belt` the index of its belt (-1 on the floor).

    `born` is its place in the order in which bottles were fed, from 1; 0 if the line started with it.
    """

    bottle: int
    born: int
    time: Floats
    vx: Floats
    vy: Floats
    belt: NDArray[np.int64]


@dataclass(frozen=True)
class Flow:
    """Flow of bottles: `time` (n,) s; `fed`, `removed`, `held`, `present` (n,) as in `BottleCounts`.

    The first three are None without recorded events. `on_belt` (n, belts) counts the bottles on each belt; `entered`
    (n, belts) counts entries onto it since the start.
    """

    time: Floats
    fed: NDArray[np.int64] | None
    removed: NDArray[np.int64] | None
    held: NDArray[np.int64] | None
    present: NDArray[np.int64]
    on_belt: NDArray[np.int64]
    entered: NDArray[np.int64]


@dataclass(frozen=True)
class PeakForceSeries:
    """Peak contact force (N) over the bottles, of the interval that ends at `time` (n,) s: largest and 99th percentile.

    `bottle` (n,) is the id of the bottle with the largest, -1 where there is no bottle.
    """

    time: Floats
    largest: Floats
    percentile_99: Floats
    bottle: NDArray[np.int64]


@dataclass(frozen=True)
class EnergySeries:
    """The energy ledger over time (s), J, each (n,): as in conveyor_msgs/Ledger; `belts` (n, belts) is their work."""

    time: Floats
    kinetic: Floats
    elastic: Floats
    springs: Floats
    fed: Floats
    removed: Floats
    belts: Floats
    base_friction: Floats
    contact_friction: Floats
    damping: Floats
    residual: Floats
    turnover: Floats
    rails: Floats
    """(n,), work of all rails that move."""


@dataclass(frozen=True)
class Damage:
    """Wear of rails at the end of a recording, and the damage maxima of each bottle."""

    time: float
    """s, of the last output."""
    wear: RailWearColumns
    bottles: int
    worst: dict[str, Floats]
    """By quantity (`DamageColumns`), one entry a bottle for which it is known."""
    limits: dict[str, float]
    """Limits of the scene."""


def box_around(points: Floats) -> tuple[float, float, float, float]:
    """Smallest box (x0, y0, x1, y1) around points (k, 2)."""
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])

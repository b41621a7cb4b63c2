# SPDX-License-Identifier: Apache-2.0
"""Box2D v3.1 on one thread: rigid discs in the box of glass, pulled by gravity in their plane as by a belt.

Its contacts are soft constraints whose stiffness follows from a frequency, `hertz`, and not from the glass; Box2D
limits it to a quarter of its rate of substeps. The wheels come from PyPI (requirements/bench.txt).
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.discs import CONTACT_FRICTION, INERTIA, PULL, RESTITUTION, walls_of
from bench.ours import PackedState
from bench.packed import MASS, RADIUS

DAMPING_RATIO, PUSH = 10.0, 3.0
"""Damping ratio of its contacts, and greatest speed at which it parts overlaps, m/s: its defaults."""


@dataclass(frozen=True)
class Tuning:
    """Steps a second, substeps of each, and stiffness of contacts as a frequency, Hz."""

    rate: float
    substeps: int
    hertz: float

    def __str__(self) -> str:
        return f"Box2D, {self.rate:g} Hz x {self.substeps}, contacts {self.hertz:g} Hz"


TUNINGS = (Tuning(60.0, 4, 30.0), Tuning(60.0, 8, 120.0), Tuning(100.0, 8, 200.0), Tuning(60.0, 16, 240.0))
"""Its defaults first."""


def why_not() -> str:
    """Return the reason for which Box2D can't be imported, "" if it can."""
    if find_spec("pyb2d3") is None:
        return "the package pyb2d3 is not installed (pip install -r requirements/bench.txt)"
    return ""


class Box2D:
    """One world of Box2D with the bottles of a packed state. Sleeping is off."""

    def __init__(self, start: PackedState, tuning: Tuning) -> None:
        b2: Any = import_module("pyb2d3")
        self._tuning = tuning
        self._world = b2.World(gravity=(PULL, 0.0))
        self._world.sleeping_enabled = False
        self._world.set_contact_tuning(tuning.hertz, DAMPING_RATIO, PUSH)
        glass = b2.surface_material(friction=CONTACT_FRICTION, restitution=RESTITUTION)
        ground = self._world.create_static_body(position=(0.0, 0.0))
        for one, other in walls_of(start.box):
            ground.create_segment_shape(b2.shape_def(material=glass), b2.segment(one, other))
        disc = b2.shape_def(density=MASS / (np.pi * RADIUS**2), material=glass)
        circle = b2.circle(center=(0.0, 0.0), radius=RADIUS)
        self._bodies = []
        for x, y, vx, vy in zip(*(values.tolist() for values in (start.x, start.y, start.vx, start.vy)), strict=True):
            body = self._world.create_dynamic_body(position=(x, y), linear_velocity=(vx, vy))
            body.create_circle_shape(disc, circle)
            mass = body.mass_data
            mass.rotational_inertia = INERTIA
            body.mass_data = mass
            self._bodies.append(body)

    def advance(self, seconds: float) -> None:
        """Take whole steps over `seconds`."""
        for _ in range(round(seconds * self._tuning.rate)):
            self._world.step(1.0 / self._tuning.rate, self._tuning.substeps)

    def positions(self) -> NDArray[np.float64]:
        """Axes, (N, 2), m."""
        return np.array([(body.position[0], body.position[1]) for body in self._bodies])

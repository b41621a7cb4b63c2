# SPDX-License-Identifier: Apache-2.0
"""pymunk (Chipmunk 2D) on one thread: rigid discs in the box of glass, pulled by gravity in their plane as by a belt.

The wheels come from PyPI (requirements/bench.txt). It multiplies coefficients of the two bodies of a contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.discs import CONTACT_FRICTION, INERTIA, PULL, RESTITUTION, walls_of
from bench.ours import PackedState
from bench.packed import MASS, RADIUS

SLOP = 1e-4
"""m, overlap that it leaves uncorrected. Its default, 0.1, is meant for pixels."""
WALL = 1e-3
"""m, radius of a wall: a segment of none lets discs through."""


@dataclass(frozen=True)
class Tuning:
    """Steps a second, and iterations of the solver in each."""

    rate: float
    iterations: int

    def __str__(self) -> str:
        return f"pymunk, {self.rate:g} Hz x {self.iterations}"


TUNINGS = (Tuning(60.0, 10), Tuning(400.0, 10))
"""Its default number of iterations, at a usual rate first."""


def why_not() -> str:
    """Return the reason for which pymunk can't be imported, "" if it can."""
    return "" if find_spec("pymunk") else "the package pymunk is not installed (pip install -r requirements/bench.txt)"


class Pymunk:
    """One space of pymunk with the bottles of a packed state. Bodies do not sleep."""

    def __init__(self, start: PackedState, tuning: Tuning) -> None:
        pymunk: Any = import_module("pymunk")
        self._tuning = tuning
        self._space = pymunk.Space()
        self._space.gravity = (PULL, 0.0)
        self._space.iterations = tuning.iterations
        self._space.collision_slop = SLOP
        # A hash of space is faster than the default tree where all shapes are alike.
        self._space.use_spatial_hash(2.0 * RADIUS, 2 * start.x.size)
        coefficients = {"friction": math.sqrt(CONTACT_FRICTION), "elasticity": math.sqrt(RESTITUTION)}
        for one, other in walls_of(start.box):
            out = _outward(one, other)
            segment = pymunk.Segment(self._space.static_body, _shifted(one, out), _shifted(other, out), WALL)
            self._add(segment, coefficients)
        self._bodies = []
        for x, y, vx, vy in zip(*(values.tolist() for values in (start.x, start.y, start.vx, start.vy)), strict=True):
            body = pymunk.Body(MASS, INERTIA)
            body.position, body.velocity = (x, y), (vx, vy)
            self._space.add(body)
            self._add(pymunk.Circle(body, RADIUS), coefficients)
            self._bodies.append(body)

    def _add(self, shape: Any, coefficients: dict[str, float]) -> None:
        shape.friction, shape.elasticity = coefficients["friction"], coefficients["elasticity"]
        self._space.add(shape)

    def advance(self, seconds: float) -> None:
        """Take whole steps over `seconds`."""
        for _ in range(round(seconds * self._tuning.rate)):
            self._space.step(1.0 / self._tuning.rate)

    def positions(self) -> NDArray[np.float64]:
        """Axes, (N, 2), m."""
        return np.array([tuple(body.position) for body in self._bodies])


def _outward(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """Return the offset that puts the surface of a wall, listed counter-clockwise, onto the box, m."""
    dx, dy = other[0] - one[0], other[1] - one[1]
    length = math.hypot(dx, dy)
    return WALL * dy / length, -WALL * dx / length


def _shifted(point: tuple[float, float], by: tuple[float, float]) -> tuple[float, float]:
    return point[0] + by[0], point[1] + by[1]

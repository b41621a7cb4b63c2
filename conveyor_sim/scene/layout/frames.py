# SPDX-License-Identifier: Apache-2.0
"""Positions with a direction of travel; m and rad."""

import math
from dataclasses import dataclass
from functools import cached_property

from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.types import XY

_ROUNDING = 4e-16
"""Relative error of a sum of a few angles."""


@dataclass(frozen=True)
class PathFrame:
    """A place on a path, with its direction of travel (rad, from the x-axis, counter-clockwise)."""

    x: float
    y: float
    angle: float

    @cached_property
    def direction(self) -> XY:
        """Cosine and sine of the direction of travel, exact at quarter turns."""
        return unit_vector(self.angle)

    @property
    def xy(self) -> XY:
        """The place (m)."""
        return self.x, self.y

    def point(self, along: float, left: float) -> XY:
        """Return the point this far (m) along the direction of travel, and to the left of it."""
        cos, sin = self.direction
        return self.x + along * cos - left * sin, self.y + along * sin + left * cos

    def seen_from(self, point: XY) -> XY:
        """Return how far (m) a point lies along the direction of travel, and to the left of it."""
        cos, sin = self.direction
        dx, dy = point[0] - self.x, point[1] - self.y
        return dx * cos + dy * sin, dy * cos - dx * sin

    def moved(self, along: float, left: float = 0.0) -> "PathFrame":
        """Return the frame at `point(along, left)` with the same direction; itself if both are 0."""
        return self if along == left == 0.0 else PathFrame(*self.point(along, left), self.angle)


def turned(angle: float, by: float) -> float:
    """Return the sum of two angles (rad) as an angle from -pi to pi, exact at multiples of a quarter turn."""
    angle += by
    if not -math.pi <= angle <= math.pi:
        angle -= 2.0 * math.pi * round(angle / (2.0 * math.pi))
    quarters = round(angle / (0.5 * math.pi))
    exact = quarters * (0.5 * math.pi)
    return exact if abs(angle - exact) <= _ROUNDING * max(1.0, abs(angle), abs(by)) else angle

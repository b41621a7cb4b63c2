# SPDX-License-Identifier: Apache-2.0
"""Common parts of rivals with rigid discs: the box of glass, the pull of its belt, and overlaps."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bench.packed import FRICTION, GRAVITY, MASS, RADIUS, Box

CONTACT_FRICTION, RESTITUTION = 0.1, 0.5
"""Coefficients of friction and of restitution of glass on glass and on walls."""
PULL = FRICTION * GRAVITY
"""m/s^2, along x: that of a belt below bottles which slip on it."""
INERTIA = MASS * RADIUS**2
"""kg m^2, of a thin-walled cylinder."""


class Discs(Protocol):
    """A rival with the bottles of a packed state."""

    def advance(self, seconds: float) -> None:
        """Take whole steps over `seconds`."""

    def positions(self) -> NDArray[np.float64]:
        """Axes, (N, 2), m."""


def walls_of(box: Box) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the ends of the four walls, m."""
    corners = [(0.0, 0.0), (box.length, 0.0), (box.length, box.width), (0.0, box.width)]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def largest_overlap(positions: NDArray[np.float64], box: Box) -> float:
    """Return the largest overlap of two bottles, or of a bottle and a wall, m; 0 without any.

    positions: axes, (N, 2), m.
    """
    x, y = positions[np.argsort(positions[:, 0])].T
    to_walls = min(x.min(), y.min(), box.length - x.max(), box.width - y.max())
    closest = np.inf
    for ahead in range(1, x.size):
        dx = x[ahead:] - x[:-ahead]
        if dx.min() >= 2.0 * RADIUS:
            break
        closest = min(closest, float(np.hypot(dx, y[ahead:] - y[:-ahead]).min()))
    return max(0.0, RADIUS - float(to_walls), 2.0 * RADIUS - closest)

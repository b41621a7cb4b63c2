# SPDX-License-Identifier: Apache-2.0
"""The paper's method in NumPy: every bottle against every other at every step. Minimal effects, semi-implicit Euler."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.measure import Contestant
from bench.ours import PackedState
from bench.packed import DT, FRICTION, GRAVITY, MASS, RADIUS, SLIP_LIMIT, SPEED, STIFFNESS, WALL_STIFFNESS

F8 = NDArray[np.float64]


class AllPairs:
    """Bottles of a box, vectorised: distances as (N, N) arrays, what follows of the closed contacts alone."""

    def __init__(self, start: PackedState) -> None:
        self.box = start.box
        self.x, self.y, self.vx, self.vy = start.x.copy(), start.y.copy(), start.vx.copy(), start.vy.copy()
        n = self.x.size
        self._dx, self._dy, self._squares = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
        self._closed = np.empty((n, n), dtype=bool)

    def contact_forces(self) -> tuple[F8, F8]:
        """Return the forces of bottles and walls on each bottle, N."""
        np.subtract.outer(self.x, self.x, out=self._dx)
        np.subtract.outer(self.y, self.y, out=self._dy)
        np.multiply(self._dx, self._dx, out=self._squares)
        np.multiply(self._dy, self._dy, out=self._dy)
        self._squares += self._dy
        np.less(self._squares, (2.0 * RADIUS) ** 2, out=self._closed)
        i, j = np.nonzero(self._closed)
        i, j = i[i != j], j[i != j]
        distance = np.sqrt(self._squares[i, j])
        push = STIFFNESS * (2.0 * RADIUS / distance - 1.0)
        n = self.x.size
        fx = np.bincount(i, push * (self.x[i] - self.x[j]), n)
        fy = np.bincount(i, push * (self.y[i] - self.y[j]), n)
        return fx + _wall_force(self.x, self.box.length), fy + _wall_force(self.y, self.box.width)

    def step(self) -> None:
        """One step of DT."""
        fx, fy = self.contact_forces()
        slip_x, slip_y = self.vx - SPEED, self.vy
        slip = np.sqrt(slip_x**2 + slip_y**2)
        ratio = slip / SLIP_LIMIT
        # mu m g p(s)/s, in which p(s)/s has a limit at rest.
        drag = FRICTION * MASS * GRAVITY * np.where(
            ratio < 1.0, (2.0 - ratio) / SLIP_LIMIT, 1.0 / np.maximum(slip, SLIP_LIMIT)
        )  # fmt: skip
        self.vx += DT / MASS * (fx - drag * slip_x)
        self.vy += DT / MASS * (fy - drag * slip_y)
        self.x += DT * self.vx
        self.y += DT * self.vy

    def contestant(self) -> Contestant:
        """Works in units of one step."""

        def work(steps: int) -> float:
            for _ in range(steps):
                self.step()
            return float(steps * self.x.size)

        return Contestant("NumPy all pairs", work, self.x.size)


def _wall_force(place: F8, end: float) -> F8:
    """Return the force of the walls at 0 and `end`, N."""
    found: F8 = WALL_STIFFNESS * (np.maximum(RADIUS - place, 0.0) - np.maximum(place + RADIUS - end, 0.0))
    return found

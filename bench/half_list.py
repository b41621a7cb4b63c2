# SPDX-License-Identifier: Apache-2.0
"""Straightforward numba program: a Verlet list of pairs, a loop that scatters forces to both, a loop that integrates.

It has minimal effects and semi-implicit Euler. No arithmetic is reordered (no fastmath), as in this project's engine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from bench.measure import Contestant
from bench.ours import PackedState
from bench.packed import DT, FRICTION, GRAVITY, MASS, RADIUS, SLIP_LIMIT, SPEED, STIFFNESS, WALL_STIFFNESS

F8 = NDArray[np.float64]
U4 = NDArray[np.uint32]

SKIN = 0.2 * RADIUS
"""m, beyond touch within which pairs are listed."""
REACH = 2.0 * RADIUS + SKIN
PAIRS_PER_BOTTLE = 5
"""Three in a packing, with room to spare."""
PULL = FRICTION * MASS * GRAVITY

Function = TypeVar("Function", bound=Callable[..., Any])


_numba_njit: Any = numba.njit


def _njit(function: Function) -> Function:
    compiled: Function = _numba_njit(error_model="numpy", nogil=True)(function)
    return compiled


class HalfList:
    """Bottles of a box."""

    def __init__(self, start: PackedState) -> None:
        self.x, self.y, self.vx, self.vy = start.x.copy(), start.y.copy(), start.vx.copy(), start.vy.copy()
        n = self.x.size
        self.fx, self.fy = np.zeros(n), np.zeros(n)
        self.box = np.array([start.box.length, start.box.width])
        self._listed_x, self._listed_y = np.full(n, np.inf), np.full(n, np.inf)
        self._pairs = np.zeros((2, PAIRS_PER_BOTTLE * n), dtype=np.uint32)
        self._used = np.zeros(1, dtype=np.int64)

    def work(self, steps: int) -> float:
        """So many steps of DT; how many bottle-steps that was."""
        listed = (self._listed_x, self._listed_y)
        place, velocity, force = (self.x, self.y), (self.vx, self.vy), (self.fx, self.fy)
        _run(steps, place, velocity, force, listed, self._pairs, self._used, self.box)
        return float(steps * self.x.size)

    def contact_forces(self) -> tuple[F8, F8]:
        """Return the forces of bottles and walls on each bottle, N."""
        self._used[0] = _list_pairs(self.x, self.y, self._pairs, self.box)
        _contact_forces(self.x, self.y, self.fx, self.fy, self._pairs, self._used[0], self.box)
        return self.fx, self.fy

    def contestant(self) -> Contestant:
        """Works in units of one step."""
        return Contestant("numba half list", self.work, self.x.size)


@_njit
def _run(steps: int, place: Any, velocity: Any, force: Any, listed: Any, pairs: U4, used: Any, box: F8) -> None:
    x, y = place
    vx, vy = velocity
    fx, fy = force
    for _ in range(steps):
        if _moved(x, y, listed[0], listed[1]):
            used[0] = _list_pairs(x, y, pairs, box)
            listed[0][:] = x
            listed[1][:] = y
        _contact_forces(x, y, fx, fy, pairs, used[0], box)
        _integrate(x, y, vx, vy, fx, fy)


@_njit
def _moved(x: F8, y: F8, listed_x: F8, listed_y: F8) -> bool:
    limit = (0.5 * SKIN) ** 2
    for i in range(x.size):  # noqa: SIM110 (numba knows no generators)
        if not (x[i] - listed_x[i]) ** 2 + (y[i] - listed_y[i]) ** 2 <= limit:
            return True
    return False


@_njit
def _list_pairs(x: F8, y: F8, pairs: U4, box: F8) -> int:
    columns, rows = int(box[0] / REACH) + 1, int(box[1] / REACH) + 1
    start = np.zeros(columns * rows + 1, np.int64)
    cell = np.empty(x.size, np.int64)
    for i in range(x.size):
        column = min(max(int(x[i] / REACH), 0), columns - 1)
        row = min(max(int(y[i] / REACH), 0), rows - 1)
        cell[i] = row * columns + column
        start[cell[i] + 1] += 1
    start = np.cumsum(start)
    order = np.argsort(cell, kind="mergesort")
    count = 0
    for i in range(x.size):
        row, column = divmod(cell[i], columns)
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            first, last = r * columns + max(column - 1, 0), r * columns + min(column + 1, columns - 1)
            for k in range(start[first], start[last + 1]):
                j = order[k]
                if j > i and (x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2 < REACH**2:
                    if count == pairs.shape[1]:
                        raise ValueError("more pairs than the list has room for")
                    pairs[0, count] = i
                    pairs[1, count] = j
                    count += 1
    return count


@_njit
def _contact_forces(x: F8, y: F8, fx: F8, fy: F8, pairs: U4, used: int, box: F8) -> None:
    for i in range(x.size):
        fx[i] = WALL_STIFFNESS * (max(RADIUS - x[i], 0.0) - max(x[i] + RADIUS - box[0], 0.0))
        fy[i] = WALL_STIFFNESS * (max(RADIUS - y[i], 0.0) - max(y[i] + RADIUS - box[1], 0.0))
    for p in range(used):
        i, j = pairs[0, p], pairs[1, p]
        dx, dy = x[j] - x[i], y[j] - y[i]
        square = dx * dx + dy * dy
        if square < 4.0 * RADIUS**2:
            push = STIFFNESS * (2.0 * RADIUS / np.sqrt(square) - 1.0)
            fx[i] -= push * dx
            fy[i] -= push * dy
            fx[j] += push * dx
            fy[j] += push * dy


@_njit
def _integrate(x: F8, y: F8, vx: F8, vy: F8, fx: F8, fy: F8) -> None:
    for i in range(x.size):
        slip_x, slip_y = vx[i] - SPEED, vy[i]
        slip = np.sqrt(slip_x * slip_x + slip_y * slip_y)
        drag = PULL * (2.0 - slip / SLIP_LIMIT) / SLIP_LIMIT if slip < SLIP_LIMIT else PULL / slip
        vx[i] += DT / MASS * (fx[i] - drag * slip_x)
        vy[i] += DT / MASS * (fy[i] - drag * slip_y)
        x[i] += DT * vx[i]
        y[i] += DT * vy[i]

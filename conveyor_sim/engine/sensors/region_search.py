# SPDX-License-Identifier: Apache-2.0
"""Search for the bottles in many regions, with one pass over all bottles after each change of their positions."""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.lists.static_grid import build_static_grid
from conveyor_sim.engine.sensors.regions import find_inside, list_near

CELL = 0.5
"""Edge of the cells of the grid, m."""

ROUNDING = 1e-9
"""Larger than the rounding error of a point on an edge, m."""


class RegionSearch:
    """Regions of one line, and the bottles near each of them."""

    def __init__(self) -> None:
        """Start without regions."""
        self._regions: list[F8] = []
        self._boxes: F8 = np.empty((0, 4))
        self._grid: StaticGrid | None = None
        self._first: I8 = np.zeros(1, np.int64)
        self._resize(64)
        self._slots: I8 = np.empty(0, np.int64)
        self._bottles: Bottles | None = None
        self._moves = -1
        self._list: Any = None
        self._find: Any = None

    def add(self, corners: F8) -> int:
        """Add a simple polygon, (n, 2), m. Return its number."""
        self._regions.append(corners)
        box = [*(corners.min(axis=0) - ROUNDING), *(corners.max(axis=0) + ROUNDING)]
        self._boxes = np.vstack((self._boxes, box))
        self._grid, self._bottles = None, None
        return len(self._regions) - 1

    def inside(self, region: int, bottles: Bottles, moves: int) -> I8:
        """Return the slots of bottles whose axes are in a region, by its number, (n,). Valid until the next call.

        moves: changes whenever a bottle is moved or added. Bottles may be removed without a change of it.
        """
        if bottles is not self._bottles or moves != self._moves:
            self._list_near(bottles)
            self._bottles, self._moves = bottles, moves
        first, end = int(self._first[region]), int(self._first[region + 1])
        arguments = self._regions[region], bottles.x, bottles.y, bottles.id, self._near, first, end, self._slots
        self._find = self._find or entry(find_inside, *arguments)
        return self._slots[: self._find(*arguments)]

    def _list_near(self, bottles: Bottles) -> None:
        if self._grid is None:
            none = np.empty((0, 4))
            self._grid = build_static_grid(none, none, none, self._boxes, 0.0, 0.0, CELL)
            self._first = np.zeros(len(self._regions) + 1, np.int64)
        if self._slots.size < bottles.id.size:
            self._slots = np.empty(bottles.id.size, np.int64)
        while (needed := self._listed(self._grid, bottles)) > self._near.size:
            self._resize(2 * needed)

    def _listed(self, grid: StaticGrid, bottles: Bottles) -> int:
        arguments = grid, self._boxes, bottles.x, bottles.y, bottles.id, self._pairs, self._first, self._near
        self._list = self._list or entry(list_near, *arguments)
        needed: int = self._list(*arguments)
        return needed

    def _resize(self, entries: int) -> None:
        self._pairs, self._near = np.empty((2, entries), np.int64), np.empty(entries, np.int64)

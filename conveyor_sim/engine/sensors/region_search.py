# SPDX-License-Identifier: Apache-2.0
"""Search for the bottles in all regions of a line, in one pass after each change of their positions."""

from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.lists.static_grid import build_static_grid
from conveyor_sim.engine.sensors.regions import list_inside

CELL = 0.5
"""Edge of the cells of the grid, m."""

ROUNDING = 1e-9
"""Larger than the rounding error of a point on an edge, m."""


class RegionSearch:
    """Regions of one line, and the bottles in each of them."""

    def __init__(self) -> None:
        """Start without regions."""
        self._corners: F8 = np.empty((0, 2))
        self._start: I8 = np.zeros(1, np.int64)
        self._boxes: F8 = np.empty((0, 4))
        self._grid: StaticGrid | None = None
        self._first: I8 = np.zeros(1, np.int64)
        self._resize(64)
        self._bottles: Bottles | None = None
        self._moves = self._removals = -1
        self._list: Any = None

    def add(self, corners: F8) -> int:
        """Add a simple polygon, (n, 2), m. Return its number."""
        self._corners = np.vstack((self._corners, corners))
        self._start = np.append(self._start, len(self._corners))
        box = [*(corners.min(axis=0) - ROUNDING), *(corners.max(axis=0) + ROUNDING)]
        self._boxes = np.vstack((self._boxes, box))
        self._grid, self._bottles = None, None
        return self._start.size - 2

    def inside(self, region: int, bottles: Bottles, moves: int, removals: int) -> I8:
        """Return the slots of bottles whose axes are in a region, by its number, (n,), in order.

        They are valid until the next call. moves: changes whenever a bottle is moved or added. removals: changes
        whenever a bottle is removed.
        """
        if bottles is not self._bottles or moves != self._moves:
            self._list_inside(bottles)
            self._bottles, self._moves, self._removals = bottles, moves, removals
        slots = self._inside[self._first.item(region) : self._first.item(region + 1)]
        return slots if removals == self._removals else slots[bottles.id[slots] >= 0]

    def _list_inside(self, bottles: Bottles) -> None:
        if self._grid is None:
            none = np.empty((0, 4))
            self._grid = build_static_grid(none, none, none, self._boxes, 0.0, 0.0, CELL)
            self._first = np.zeros(self._start.size, np.int64)
        while (needed := self._listed(self._grid, bottles)) > self._inside.size:
            self._resize(2 * needed)

    def _listed(self, grid: StaticGrid, bottles: Bottles) -> int:
        regions = grid, self._boxes, self._corners, self._start
        arguments = *regions, bottles.x, bottles.y, bottles.id, self._pairs, self._first, self._inside
        self._list = self._list or entry(list_inside, *arguments)
        needed: int = self._list(*arguments)
        return needed

    def _resize(self, entries: int) -> None:
        self._pairs, self._inside = np.empty((2, entries), np.int64), np.empty(entries, np.int64)

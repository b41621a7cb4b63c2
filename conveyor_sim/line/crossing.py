"""Passages of bottles' axes over a line within a tick, with the time of each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.line.device import ScanContext


@dataclass(frozen=True)
class Passages:
    """Bottles that passed a line in a tick, in the order of time, (n,)."""

    id: I8
    time: F8
    """s, simulated."""
    forward: NDArray[np.bool_]
    """From the left of the line to its right, seen from its first end."""


class CrossingLine:
    """A line from one point (m) to another that axes pass over; it has to see every tick's beginning and end."""

    def __init__(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self._start = np.array(start)
        self._along = np.array(end) - self._start
        self._before: tuple[I8, F8, F8] | None = None

    def begin(self, now: ScanContext) -> None:
        """Note where the bottles are before the steps of a tick."""
        bottles = now.state.world.bottles
        self._before = (bottles.id.copy(), *self._seen(bottles.x, bottles.y))

    def end(self, now: ScanContext) -> Passages:
        """Who passed since then: straight between the two places, the time in proportion."""
        bottles = now.state.world.bottles
        if self._before is None:
            return Passages(np.empty(0, np.int64), np.empty(0), np.empty(0, np.bool_))
        ids, left_before, along_before = self._before
        left, along = self._seen(bottles.x[: ids.size], bottles.y[: ids.size])
        passed = (ids >= 0) & (bottles.id[: ids.size] == ids) & ((left_before > 0.0) != (left > 0.0))
        share = np.zeros(ids.size)
        share[passed] = left_before[passed] / (left_before[passed] - left[passed])
        place = along_before + share * (along - along_before)
        slots = np.flatnonzero(passed & (place >= 0.0) & (place <= 1.0))
        time = now.time - (1.0 - share[slots]) * now.length
        order = np.lexsort((ids[slots], time))
        slots = slots[order]
        return Passages(ids[slots], time[order], left_before[slots] > 0.0)

    def _seen(self, x: F8, y: F8) -> tuple[F8, F8]:
        """How far points are to the left of the line (in its lengths), and how far along it (0 to 1)."""
        dx, dy = x - self._start[0], y - self._start[1]
        square = float(self._along @ self._along)
        left = (self._along[0] * dy - self._along[1] * dx) / square
        return left, (self._along[0] * dx + self._along[1] * dy) / square

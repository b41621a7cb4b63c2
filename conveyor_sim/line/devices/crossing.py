"""Passages of bottles' axes over a line within a tick, with the time of each."""

from typing import NamedTuple

import numpy as np

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.sensors.crossings import find_crossings
from conveyor_sim.line.device import ScanContext


class Passage(NamedTuple):
    """Passage of one bottle over a line."""

    time: float
    """Simulated time, s."""
    id: int
    forward: bool
    """True from the left of the line to its right, seen from its first end."""


class CrossingLine:
    """Line between two points (m) that bottle axes pass over. Needs `begin` and `end` in every tick."""

    def __init__(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        along = np.array(end) - np.array(start)
        self._line = np.array([*start, *along, float(along @ along)])
        self._room: tuple[F8, I8] = np.empty((2, 0)), np.empty(0, np.int64)
        self._before: tuple[F8, I8] | None = None
        self._buffers: tuple[I8, F8, I8] = (np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions before the steps of a tick."""
        bottles = now.state.world.bottles
        if self._room[1].size != bottles.id.size:
            self._room = np.empty((2, bottles.id.size)), np.empty(bottles.id.size, np.int64)
        self._before = self._room
        places, ids = self._before
        places[0], places[1], ids[:] = bottles.x, bottles.y, bottles.id

    def end(self, now: ScanContext) -> list[Passage]:
        """Return the passages since `begin` in order of time.

        The path between the two positions is taken as straight, and the time is interpolated.
        """
        bottles = now.state.world.bottles
        if self._before is None:
            return []
        before, ids = self._before
        if self._buffers[0].size < ids.size:
            self._buffers = np.empty(ids.size, np.int64), np.empty(ids.size), np.empty(ids.size, np.int64)
        slots, share, forward = self._buffers
        count = find_crossings(before, ids, bottles.x, bottles.y, bottles.id, self._line, slots, share, forward)
        return sorted(
            Passage(now.time - (1.0 - float(share[n])) * now.length, int(ids[slots[n]]), bool(forward[n]))
            for n in range(count)
        )

"""Passages of bottles' axes over a line within a tick, with the time of each."""

from typing import NamedTuple

import numpy as np

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.sensors.crossings import find_crossings
from conveyor_sim.line.device import ScanContext


class Passage(NamedTuple):
    """A bottle that passed a line."""

    time: float
    """s, simulated."""
    id: int
    forward: bool
    """From the left of the line to its right, seen from its first end."""


class CrossingLine:
    """A line from one point (m) to another that axes pass over; it has to see every tick's beginning and end."""

    def __init__(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        along = np.array(end) - np.array(start)
        self._line = np.array([*start, *along, float(along @ along)])
        self._room: tuple[F8, I8] = np.empty((2, 0)), np.empty(0, np.int64)
        self._before: tuple[F8, I8] | None = None
        self._found: tuple[I8, F8, I8] = (np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))

    def begin(self, now: ScanContext) -> None:
        """Note where the bottles are before the steps of a tick."""
        bottles = now.state.world.bottles
        if self._room[1].size != bottles.id.size:
            self._room = np.empty((2, bottles.id.size)), np.empty(bottles.id.size, np.int64)
        self._before = self._room
        places, ids = self._before
        places[0], places[1], ids[:] = bottles.x, bottles.y, bottles.id

    def end(self, now: ScanContext) -> list[Passage]:
        """Who passed since then, in the order of time: straight between the two places, the time in proportion."""
        bottles = now.state.world.bottles
        if self._before is None:
            return []
        before, ids = self._before
        if self._found[0].size < ids.size:
            self._found = np.empty(ids.size, np.int64), np.empty(ids.size), np.empty(ids.size, np.int64)
        slots, share, forward = self._found
        count = find_crossings(before, ids, bottles.x, bottles.y, bottles.id, self._line, slots, share, forward)
        return sorted(
            Passage(now.time - (1.0 - float(share[n])) * now.length, int(ids[slots[n]]), bool(forward[n]))
            for n in range(count)
        )

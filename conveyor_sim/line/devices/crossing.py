# SPDX-License-Identifier: Apache-2.0
"""Lines that bottle axes cross within a tick: passages with their times, counters and inspections."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.sensors.crossings import find_crossings
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.inspection import Inspection


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


class CounterDevice(Device):
    """Counter of bottles whose axes pass over a line, by direction."""

    def __init__(self, name: str, counter: Counter, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                count(f"{name}/forward", "counter", "Bottles that passed from left to right, seen along its line."),
                count(f"{name}/backward", "counter", "Bottles that passed in the opposite direction."),
            ],
        )
        self._line = CrossingLine(counter.from_, counter.to)
        self.forward = self.backward = 0

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions."""
        self._line.begin(now)

    def end(self, now: ScanContext) -> None:
        """Count the passages of this tick. A bottle that returns within the tick is not counted."""
        for passage in self._line.end(now):
            if passage.forward:
                self.forward += 1
            else:
                self.backward += 1

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        return self.forward, self.backward


class InspectionDevice(Device):
    """Machine that detects bad bottles among those that pass a line."""

    def __init__(self, name: str, inspection: Inspection, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                switch(f"{name}/running", "status", "Inspects bottles, and is not stopped.", 1.0, "state"),
                count(f"{name}/count", "counter", "Bottles that passed from left to right, seen along its line."),
                count(f"{name}/bad", "counter", "Bad bottles among them."),
                seconds(f"{name}/time", "actual", "Time of the last passage, between ticks."),
                seconds(f"{name}/bad_time", "actual", "Time of the last bad bottle's passage, between ticks."),
                switch(f"{name}/stop", "fault", "Sees no bottles."),
            ],
        )
        self._line = CrossingLine(inspection.from_, inspection.to)
        self.stop = False
        self.count = self.bad = 0
        self.time = self.bad_time = 0.0
        """Times when the last bottle passed, and the last bad one, s."""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the fault `stop`."""
        self.stop = value != 0.0

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions."""
        self._line.begin(now)

    def end(self, now: ScanContext) -> None:
        """Inspect the bottles that passed."""
        for passage in self._line.end(now):
            if passage.forward and not self.stop:
                self.count, self.time = self.count + 1, passage.time
                if passage.id in now.bad:
                    self.bad, self.bad_time = self.bad + 1, passage.time

    def states(self, now: ScanContext) -> list[float]:
        """Return running."""
        return [not self.stop]

    def counts(self) -> tuple[int, int, int]:
        """Return bottles that passed, and bad ones among them."""
        return self.count, self.bad, 0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return running, passed bottles, bad ones among them, and the times of the last ones (s)."""
        return not self.stop, self.count, self.bad, self.time, self.bad_time

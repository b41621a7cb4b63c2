# SPDX-License-Identifier: Apache-2.0
"""Lines that bottle axes cross within a tick: passages with their times, counters and inspections."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.numba_internals.machine_code import entry
from conveyor_sim.engine.sensors.crossings import find_crossings
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.types import XY


class Passage(NamedTuple):
    """Passage of one bottle over a line."""

    time: float
    """Simulated time, s."""
    id: int
    forward: bool
    """True from the left of the line to its right, seen from its first end."""


class CrossedDevice(Device):
    """Device on a line that bottle axes cross."""

    def passed(self, passages: Sequence[Passage], now: ScanContext) -> None:
        """Take the passages of a tick, in order of time; at least one."""
        raise NotImplementedError(f"{self.name} takes no passages")


class Crossings(Device):
    """All lines that bottle axes cross, evaluated in one pass over lines and bottles."""

    def __init__(self) -> None:
        """Start without lines."""
        super().__init__("crossings")
        self._owners: list[CrossedDevice] = []
        self._lines: F8 = np.empty((0, 5))
        self._bottles: Bottles | None = None
        self._began = False
        self._find: Any = None

    def add(self, owner: CrossedDevice, start: XY, end: XY) -> None:
        """Add a line between two points (m), and the device that takes its passages."""
        along = np.array(end) - np.array(start)
        self._owners.append(owner)
        self._lines = np.vstack((self._lines, [*start, *along, float(along @ along)]))

    def begin(self, now: ScanContext) -> None:
        """Store the bottle positions before the steps of a tick."""
        bottles = now.state.world.bottles
        if bottles is not self._bottles:
            slots, most = bottles.id.size, len(self._lines) * bottles.id.size
            self._bottles, self._before = bottles, np.empty((2, slots))
            self._crossed, self._share = np.empty((3, most), np.int64), np.empty(most)
        self._before[0], self._before[1] = bottles.x, bottles.y
        self._began = True

    def end(self, now: ScanContext) -> None:
        """Report the passages since `begin`.

        The path between the two positions is taken as straight, and the time is interpolated.
        """
        if not self._began:
            return
        bottles = now.state.world.bottles
        arguments = self._before, bottles.x, bottles.y, bottles.id, self._lines, self._crossed, self._share
        self._find = self._find or entry(find_crossings, *arguments)
        if not (count := self._find(*arguments)):
            return
        passages: dict[int, list[Passage]] = {}
        rows = zip(*self._crossed[:, :count].tolist(), self._share[:count].tolist(), strict=True)
        for line, slot, forward, share in rows:
            passage = Passage(now.time - (1.0 - share) * now.length, int(bottles.id[slot]), bool(forward))
            passages.setdefault(line, []).append(passage)
        for line, passed in passages.items():
            self._owners[line].passed(sorted(passed), now)


class CounterDevice(CrossedDevice):
    """Counter of bottles whose axes pass over a line, by direction."""

    def __init__(self, name: str, counter: Counter, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                count(f"{name}/forward", "counter", "Bottles that passed from left to right, seen along its line."),
                count(f"{name}/backward", "counter", "Bottles that passed in the opposite direction."),
            ],
        )
        setup.shared(Crossings, Crossings).add(self, counter.from_, counter.to)
        self.forward = self.backward = 0

    def passed(self, passages: Sequence[Passage], now: ScanContext) -> None:
        """Count the passages of this tick. A bottle that returns within the tick is not counted."""
        for passage in passages:
            if passage.forward:
                self.forward += 1
            else:
                self.backward += 1

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        return self.forward, self.backward


class InspectionDevice(CrossedDevice):
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
        setup.shared(Crossings, Crossings).add(self, inspection.from_, inspection.to)
        self.stop = False
        self.count = self.bad = 0
        self.time = self.bad_time = 0.0
        """Times when the last bottle passed, and the last bad one, s."""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the fault `stop`."""
        self.stop = value != 0.0

    def passed(self, passages: Sequence[Passage], now: ScanContext) -> None:
        """Inspect the bottles that passed."""
        for passage in passages:
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

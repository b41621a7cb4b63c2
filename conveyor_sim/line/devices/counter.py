"""Counters of bottles whose axes pass over a line, by direction."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.crossing import CrossingLine
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count
from conveyor_sim.scene.parts.counter import Counter


class CounterDevice(Device):
    """Counter of a running line."""

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

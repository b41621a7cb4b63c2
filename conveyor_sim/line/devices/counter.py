"""Counters: bottles whose axis passes over a line, by direction."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.crossing import CrossingLine
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count
from conveyor_sim.scene.parts.counter import Counter


class CounterDevice(Device):
    """One counter while it runs."""

    def __init__(self, name: str, counter: Counter, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                count(f"{name}/forward", "counter", "Bottles that passed from left to right, seen along its line."),
                count(f"{name}/backward", "counter", "Bottles that passed the other way."),
            ],
        )
        self._line = CrossingLine(counter.from_, counter.to)
        self.forward = self.backward = 0

    def begin(self, now: ScanContext) -> None:
        """See where the bottles start."""
        self._line.begin(now)

    def end(self, now: ScanContext) -> None:
        """Count the passages of this tick; a bottle that comes to the line and goes back within it makes none."""
        for passage in self._line.end(now):
            if passage.forward:
                self.forward += 1
            else:
                self.backward += 1

    def values(self, now: ScanContext) -> Sequence[float]:
        """As its signals are listed."""
        return self.forward, self.backward

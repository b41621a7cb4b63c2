"""Inspections: machines that detect bad bottles among those that pass."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.crossing import CrossingLine
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.inspection import Inspection


class InspectionDevice(Device):
    """Inspection of a running line."""

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

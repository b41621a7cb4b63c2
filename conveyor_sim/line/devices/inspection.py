"""Inspections: machines that see which of the bottles that pass are bad."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.crossing import CrossingLine
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.inspection import Inspection


class InspectionDevice(Device):
    """One inspection while it runs."""

    def __init__(self, name: str, inspection: Inspection, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                switch(f"{name}/running", "status", "It looks at bottles, and nobody has stopped it.", 1.0, "state"),
                count(f"{name}/count", "counter", "Bottles that passed from left to right, seen along its line."),
                count(f"{name}/bad", "counter", "Bad bottles among them."),
                seconds(f"{name}/time", "actual", "When the last bottle passed, between ticks."),
                seconds(f"{name}/bad_time", "actual", "When the last bad bottle passed, between ticks."),
                switch(f"{name}/stop", "fault", "Sees no bottles."),
            ],
        )
        self._line = CrossingLine(inspection.from_, inspection.to)
        self.stop = False
        self.count = self.bad = 0
        self.time = self.bad_time = 0.0
        """s, when the last bottle passed, and the last bad one."""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take the fault stop."""
        self.stop = value != 0.0

    def begin(self, now: ScanContext) -> None:
        """Note where the bottles are."""
        self._line.begin(now)

    def end(self, now: ScanContext) -> None:
        """Look at those that passed."""
        for passage in self._line.end(now):
            if passage.forward and not self.stop:
                self.count, self.time = self.count + 1, passage.time
                if passage.id in now.bad:
                    self.bad, self.bad_time = self.bad + 1, passage.time

    def states(self, now: ScanContext) -> list[float]:
        """Running."""
        return [not self.stop]

    def counts(self) -> tuple[int, int, int]:
        """Bottles that passed, and bad ones among them."""
        return self.count, self.bad, 0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Running, bottles that passed, bad ones among them, and when the last of each did (s)."""
        return not self.stop, self.count, self.bad, self.time, self.bad_time

# SPDX-License-Identifier: Apache-2.0
"""Spills: bottles that a test drops onto the line."""

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.edge import RisingEdge
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, switch
from conveyor_sim.scene.parts.spill import Spill


class SpillDevice(Device):
    """One spill. Each rising edge of its fault drops a bottle as soon as there is room."""

    def __init__(self, name: str, spill: Spill, setup: DeviceSetup) -> None:
        super().__init__(
            name,
            [
                count(f"{name}/dropped", "counter", "Bottles dropped.", high=spill.count, adds_to="fed").of("fed"),
                switch(f"{name}/drop", "fault", "Its rising edge drops a bottle as soon as there is room."),
            ],
        )
        self._spill, self._entry = spill, setup.entry(spill.bottle, 0.0, 0.0)
        self.drop = RisingEdge()
        self.due = 0
        self.fed = 0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the fault `drop`."""
        if self.drop.rises(value) and self.fed + self.due < self._spill.count:
            self.due += 1

    def feed(self, now: ScanContext) -> None:
        """Drop the bottles that are due."""
        while self.due and self._entry.has_room(now.state, [self._spill.position]):
            self._entry.enter(now.state, *self._spill.position)
            self.due -= 1
            self.fed += 1

"""Outfeeds: regions that remove bottles whose axes are inside."""

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.region import Region
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count
from conveyor_sim.scene.parts.outfeed import Outfeed


class OutfeedDevice(Device):
    """Outfeed of a running line."""

    def __init__(self, name: str, outfeed: Outfeed, setup: DeviceSetup) -> None:
        super().__init__(
            name, [count(f"{name}/removed", "counter", "Bottles removed.", adds_to="removed").of("removed")]
        )
        self._region = Region(outfeed.region)
        self.removed = 0

    def take(self, now: ScanContext) -> None:
        """Remove the bottles that are inside now."""
        for slot in self._region.inside(now.state.world.bottles).tolist():
            now.state.remove(slot)
            self.removed += 1

    def counts(self) -> tuple[int, int, int]:
        """Return removed bottles. None of them are inspected."""
        return self.removed, 0, 0

"""Outfeeds: regions that remove the bottles whose axis is inside."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.polygon import in_polygon
from conveyor_sim.line.process_image import Signal
from conveyor_sim.line.setup import Setup
from conveyor_sim.scene.parts.outfeed import Outfeed


class OutfeedDevice(Device):
    """One outfeed while it runs."""

    def __init__(self, name: str, outfeed: Outfeed, setup: Setup) -> None:
        super().__init__(name, [Signal(f"{name}/removed", "1", "count", "removed")])
        self._corners = np.array(outfeed.region)
        self.removed = 0

    def take(self, now: ScanContext) -> None:
        """Remove the bottles that are inside now."""
        bottles = now.state.world.bottles
        inside = in_polygon(self._corners, bottles.x, bottles.y) & (bottles.id >= 0)
        for slot in np.flatnonzero(inside):
            now.state.remove(int(slot))
            self.removed += 1

    def values(self, now: ScanContext) -> Sequence[float]:
        """Bottles removed so far."""
        return (self.removed,)

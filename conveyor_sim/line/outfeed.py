"""Outfeeds: regions that remove the bottles whose axis is inside."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.process_image import Signal
from conveyor_sim.scene.parts.outfeed import Outfeed


class OutfeedDevice(Device):
    """One outfeed while it runs."""

    def __init__(self, name: str, outfeed: Outfeed) -> None:
        super().__init__(f"outfeeds/{name}", [Signal(f"outfeeds/{name}/removed", "1", "count", "removed")])
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


def in_polygon(corners: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether points (k,) lie in a simple polygon (n, 2), by the parity of edges crossed on the way to the right."""
    inside = np.zeros(x.shape, dtype=bool)
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y1 != y2:
            crossed = (y1 > y) != (y2 > y)
            inside ^= crossed & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside

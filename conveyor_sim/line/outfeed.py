"""Outfeeds: regions that remove the bottles whose axis is inside."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.schema import Outfeed
from conveyor_sim.state import State


@dataclass
class OutfeedState:
    """One outfeed while it runs."""

    corners: NDArray[np.float64]
    """(n, 2), m"""
    removed: int = 0

    def take(self, state: State) -> None:
        """Remove the bottles that are inside now."""
        bottles = state.world.bottles
        inside = in_polygon(self.corners, bottles.x, bottles.y) & (bottles.id >= 0)
        for slot in np.flatnonzero(inside):
            state.remove(int(slot))
            self.removed += 1


def outfeed_states(outfeeds: dict[str, Outfeed]) -> dict[str, OutfeedState]:
    """One state an outfeed."""
    return {name: OutfeedState(np.array(outfeed.region)) for name, outfeed in outfeeds.items()}


def in_polygon(corners: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether points (k,) lie in a simple polygon (n, 2), by the parity of edges crossed on the way to the right."""
    inside = np.zeros(x.shape, dtype=bool)
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y1 != y2:
            crossed = (y1 > y) != (y2 > y)
            inside ^= crossed & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside

"""Region of the plane from which devices take bottles, or in which they count them."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.sensors.regions import find_inside
from conveyor_sim.scene.types import XY


def most_inside(corners: Sequence[XY] | F8, radius: float) -> int:
    """Return how many bottles of a radius (m) can have their axes in a simple polygon (m).

    Estimated from the area within one radius of the polygon.
    """
    outline = np.asarray(corners, dtype=np.float64)
    after = np.roll(outline, -1, axis=0)
    area = 0.5 * abs(float(np.sum(outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0])))
    length = float(np.hypot(*(after - outline).T).sum())
    bottle = math.pi * radius * radius
    return math.floor((area + length * radius + bottle) / bottle + 1e-9)


class Region:
    """Simple polygon."""

    def __init__(self, corners: Sequence[XY]) -> None:
        """Store the corners, in order, m."""
        self.corners: NDArray[np.float64] = np.array(corners, dtype=np.float64)
        self._slots: I8 = np.empty(0, dtype=np.int64)

    def inside(self, bottles: Bottles) -> I8:
        """Return the slots of bottles whose axes are inside, (n,). Valid until the next call."""
        if self._slots.size < bottles.id.size:
            self._slots = np.empty(bottles.id.size, dtype=np.int64)
        return self._slots[: find_inside(self.corners, bottles.x, bottles.y, bottles.id, self._slots)]

"""A region of the plane that devices take bottles from, or count them in."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.sensors.regions import find_inside
from conveyor_sim.scene.types import XY


def most_inside(corners: Sequence[XY] | F8, radius: float) -> int:
    """Bottles of a radius (m) that can have their axes in a simple polygon (m): by the area within a radius of it."""
    outline = np.asarray(corners, dtype=np.float64)
    after = np.roll(outline, -1, axis=0)
    area = 0.5 * abs(float(np.sum(outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0])))
    length = float(np.hypot(*(after - outline).T).sum())
    bottle = math.pi * radius * radius
    return math.floor((area + length * radius + bottle) / bottle + 1e-9)


class Region:
    """A simple polygon."""

    def __init__(self, corners: Sequence[XY]) -> None:
        """corners: in order, m."""
        self.corners: NDArray[np.float64] = np.array(corners, dtype=np.float64)
        self._slots: I8 = np.empty(0, dtype=np.int64)

    def inside(self, bottles: Bottles) -> I8:
        """Slots of the bottles whose axes are inside now, (n,); until the next call."""
        if self._slots.size < bottles.id.size:
            self._slots = np.empty(bottles.id.size, dtype=np.int64)
        return self._slots[: find_inside(self.corners, bottles.x, bottles.y, bottles.id, self._slots)]

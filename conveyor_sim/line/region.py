"""A region of the plane that devices take bottles from, or count them in."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.types import I8
from conveyor_sim.engine.sensors.regions import find_inside
from conveyor_sim.scene.types import XY


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

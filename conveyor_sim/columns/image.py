"""The process image as it is read, and what is true where it is forced."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NOTHING_FORCED = np.empty(0, dtype=np.uint32), np.empty(0)


@dataclass(frozen=True)
class Image:
    """The signals at a tick; the fields of conveyor_msgs/Signals in its order."""

    values: NDArray[np.float64]
    """Of all signals, as controllers read them."""
    forced: NDArray[np.uint32]
    """Indices of those that are forced, ascending."""
    actual: NDArray[np.float64]
    """What the line has there."""

    @property
    def truth(self) -> NDArray[np.float64]:
        """Of all signals, what the line has."""
        if not len(self.forced):
            return self.values
        values = self.values.copy()
        values[self.forced] = self.actual
        return values

# SPDX-License-Identifier: Apache-2.0
"""Process image as controllers read it, with the true values of forced signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NOTHING_FORCED = np.empty(0, dtype=np.uint32), np.empty(0)


@dataclass(frozen=True)
class Image:
    """Signals at a tick; the fields of conveyor_msgs/Signals in message order."""

    values: NDArray[np.float64]
    """Values of all signals as controllers read them."""
    forced: NDArray[np.uint32]
    """Indices of forced signals, ascending."""
    actual: NDArray[np.float64]
    """True values of the forced signals."""

    @property
    def truth(self) -> NDArray[np.float64]:
        """Return the true values of all signals."""
        if not len(self.forced):
            return self.values
        values = self.values.copy()
        values[self.forced] = self.actual
        return values

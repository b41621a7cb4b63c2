"""What a controller's variables were after a scan, those that are recorded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class VariableColumns:
    """Each variable, (n,); the fields of conveyor_msgs/Variables in its order."""

    name: Sequence[str]
    """As conditions have them: plc/main/speed."""
    value: NDArray[np.float64]
    """A BOOL is 0 or 1, a TIME is in s, a text is its length."""

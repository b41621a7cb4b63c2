# SPDX-License-Identifier: Apache-2.0
"""Recorded variables of a controller after a scan."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class VariableColumns:
    """All recorded variables, (n,); the fields of conveyor_msgs/Variables in message order."""

    name: Sequence[str]
    """Names as used in conditions, such as plc/main/speed."""
    value: NDArray[np.float64]
    """Values: a BOOL as 0 or 1, a TIME in s, a text as its length."""

# SPDX-License-Identifier: Apache-2.0
"""Command values in force and their writers, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ReadBackColumns:
    """All commands in the order of the process image; the fields of conveyor_msgs/ReadBack in message order."""

    value: NDArray[np.float64]
    """Value in force."""
    since: NDArray[np.uint64]
    """Tick since which this value of this writer is in force."""
    writer: NDArray[np.uint16]
    """Index in `writers`."""
    writers: Sequence[str]
    """Names of the writers; the first is "scene", for initial values."""
    writer_kinds: Sequence[str]
    """Kinds of the writers."""

"""What commands are set to, and who set them, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ReadBackColumns:
    """Every command in the order of the process image; the fields of conveyor_msgs/ReadBack in its order."""

    value: NDArray[np.float64]
    """In force."""
    since: NDArray[np.uint64]
    """Tick from which on it has had this value from this writer."""
    writer: NDArray[np.uint16]
    """Index in `writers`."""
    writers: Sequence[str]
    """By name; the first is "scene": what was there at the start."""
    writer_kinds: Sequence[str]
    """Of these."""

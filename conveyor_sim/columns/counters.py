"""What machines have made, and where their time went."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LINE = "line"
"""Name of the last entry: the line as a whole."""


@dataclass(frozen=True)
class CounterColumns:
    """Each device that counts bottles, then the line, (n,); the fields of conveyor_msgs/Counters in its order.

    All of it since the last reset, or the start. Times and what follows from them are those of machines that can be
    started and stopped; of other devices times are 0, and the rest NaN. Those of the line are its bottleneck's.
    """

    name: Sequence[str]
    since: NDArray[np.uint64]
    """Tick of the last reset."""
    processed: NDArray[np.uint64]
    """Bottles; of the line, those that left it by a sink or an outfeed."""
    good: NDArray[np.uint64]
    defective: NDArray[np.uint64]
    rejected: NDArray[np.uint64]
    """Thrown out."""
    failures: NDArray[np.uint64]
    running: NDArray[np.float64]
    """s, as those that follow; `line/machines/time_account.py` says what each is."""
    starved: NDArray[np.float64]
    blocked: NDArray[np.float64]
    down: NDArray[np.float64]
    planned: NDArray[np.float64]
    idle: NDArray[np.float64]
    rate: NDArray[np.float64]
    """1/s, nominal."""
    availability: NDArray[np.float64]
    """These by `line/machines/efficiency.py`; NaN while nothing is known."""
    effectiveness: NDArray[np.float64]
    quality: NDArray[np.float64]
    oee: NDArray[np.float64]
    mtbf: NDArray[np.float64]
    """s"""
    mttr: NDArray[np.float64]
    """s"""
    category: Sequence[str]
    """Where its time goes now; "" without times."""
    stop_reason: Sequence[str]
    """Why it does not run, or last did not; "" without times."""
    bottleneck: Sequence[str]
    """The machines that bound the line by their nominal rates, in parallel if several."""

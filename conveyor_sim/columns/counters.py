# SPDX-License-Identifier: Apache-2.0
"""Production counters and time categories of machines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LINE = "line"
"""Name of the last entry, the complete line."""


@dataclass(frozen=True)
class CounterColumns:
    """All devices that count bottles, then the line, (n,); the fields of conveyor_msgs/Counters in message order.

    Values accumulate since the last reset, or the start. Only machines that can be started and stopped have times and
    ratios; for other devices times are 0 and ratios NaN. The line has those of its bottleneck.
    """

    name: Sequence[str]
    since: NDArray[np.uint64]
    """Tick of the last reset."""
    processed: NDArray[np.uint64]
    """Processed bottles; for the line, bottles that left by a sink or an outfeed."""
    good: NDArray[np.uint64]
    defective: NDArray[np.uint64]
    rejected: NDArray[np.uint64]
    """Rejected bottles."""
    failures: NDArray[np.uint64]
    running: NDArray[np.float64]
    """Time in the category "running", s; the following fields likewise.

    `line/machines/efficiency.py` defines them.
    """
    starved: NDArray[np.float64]
    blocked: NDArray[np.float64]
    down: NDArray[np.float64]
    planned: NDArray[np.float64]
    idle: NDArray[np.float64]
    rate: NDArray[np.float64]
    """Nominal rate, 1/s: the one of the scene."""
    availability: NDArray[np.float64]
    """Ratios as defined in `line/machines/efficiency.py`; NaN before the first cycle."""
    effectiveness: NDArray[np.float64]
    quality: NDArray[np.float64]
    oee: NDArray[np.float64]
    mtbf: NDArray[np.float64]
    """s"""
    mttr: NDArray[np.float64]
    """s"""
    category: Sequence[str]
    """Present time category; "" for a device without times."""
    stop_reason: Sequence[str]
    """Reason of the present or the last stop; "" for a device without times."""
    bottleneck: Sequence[str]
    """Machines whose fastest permitted rates limit the line; several if they run in parallel."""
    rate_limit: NDArray[np.float64]
    """Fastest permitted rate, 1/s: the reference of effectiveness and OEE."""
    set_effectiveness: NDArray[np.float64]
    """Effectiveness against the set rate."""

"""The alarms of a line and their states, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class AlarmColumns:
    """All alarms that are known, in the order in which they became so; the fields of conveyor_msgs/AlarmStates."""

    number: NDArray[np.uint64]
    """From 1; an alarm keeps its own."""
    id: Sequence[str]
    text: Sequence[str]
    alarm_class: Sequence[str]
    """error, warning or message."""
    priority: NDArray[np.uint16]
    """1 to 1000, the severity of OPC UA."""
    tag: Sequence[str]
    """Signal that it is about; empty: none."""
    group: Sequence[str]
    suppressed_by: Sequence[str]
    """JSON lists of ids."""
    latching: NDArray[np.bool_]
    declared_by: Sequence[str]
    """line, scene or who declared it; empty: nobody did."""
    state: NDArray[np.uint8]
    """Of `line/alarms/alarm.py`."""
    active: NDArray[np.bool_]
    """Whether its condition holds, after its delays, whatever its state."""
    first_out: NDArray[np.bool_]
    """Whether it was the first of its group."""
    shelved_until: NDArray[np.int64]
    """Tick; -1: not shelved for a time."""
    since: NDArray[np.uint64]
    """Tick of the last change of its state."""
    changed_by: Sequence[str]
    """Who acknowledged, shelved or reset it, or took it out of service or back, last."""

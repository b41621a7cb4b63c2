# SPDX-License-Identifier: Apache-2.0
"""The alarms of a line and their states, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class AlarmColumns:
    """All alarms, declared or not, in the order of their numbers; the fields of conveyor_msgs/AlarmStates."""

    number: NDArray[np.uint64]
    """Number of the alarm, from 1; it never changes."""
    id: Sequence[str]
    text: Sequence[str]
    alarm_class: Sequence[str]
    """error, warning or message."""
    priority: NDArray[np.uint16]
    """1 to 1000, the severity of OPC UA."""
    tag: Sequence[str]
    """Signal that the alarm monitors; empty: none."""
    group: Sequence[str]
    suppressed_by: Sequence[Sequence[str]]
    """Ids of the alarms that each alarm follows from."""
    latching: NDArray[np.bool_]
    declared_by: Sequence[str]
    """line, scene or the name of the controller that declared the alarm; empty: not declared."""
    state: NDArray[np.uint8]
    """Alarm state as numbered in `line/alarms/alarm.py`."""
    active: NDArray[np.bool_]
    """True while the alarm condition holds, after its delays, in every alarm state."""
    first_out: NDArray[np.bool_]
    """True for the first active alarm of its group."""
    shelved_until: NDArray[np.int64]
    """Tick at which shelving ends; -1: not shelved for a limited time."""
    since: NDArray[np.uint64]
    """Tick of the last state change."""
    changed_by: Sequence[str]
    """Author of the last acknowledgement, shelving, reset, or change of service."""

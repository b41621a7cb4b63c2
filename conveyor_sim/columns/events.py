# SPDX-License-Identifier: Apache-2.0
"""Events of a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Kind = Literal[
    "bottle_fed",
    "bottle_removed",
    "bottle_rejected",
    "bottle_spawned",
    "bottle_deleted",
    "alarm_raised",
    "alarm_cleared",
    "alarm_latched",
    "alarm_acknowledged",
    "alarm_confirmed",
    "alarm_reset",
    "alarm_shelved",
    "alarm_unshelved",
    "alarm_suppressed",
    "alarm_out_of_service",
    "alarm_in_service",
    "machine_state",
    "fault_injected",
    "fault_cleared",
    "command_refused",
    "mode_changed",
    "owner_changed",
    "signal_forced",
    "signal_unforced",
    "limit_passed",
]


class Event(NamedTuple):
    """Event of a line."""

    at: int
    """Tick at which the event took effect. Inputs (command, fault, alarm) take effect at the start of a scan, and other
    events at its end."""
    kind: str
    """One of `Kind`."""
    name: str
    """Name of the device for bottle events, of the writer for spawned and deleted bottles, of the signal for machine
    states; else of the alarm, fault, command, limit, forced signal, device with a new mode, or controller that took or
    released the line."""
    bottle: int
    """Bottle ID; -1: none."""
    value: float
    """Value of the state, fault, alarm, limit, command, force or mode. Ownership: 1 taken, 0 released. Bottle events:
    number of bottles that the device has fed or removed."""
    text: str
    """Reason or description; may be empty."""


@dataclass(frozen=True)
class EventColumns:
    """Events since the previous tick, in order; the fields of conveyor_msgs/Events."""

    total: int
    """Number of events since the start of the run, these included."""
    at: NDArray[np.uint64]
    kind: Sequence[str]
    name: Sequence[str]
    bottle: NDArray[np.int64]
    value: NDArray[np.float64]
    text: Sequence[str]


def event_columns(events: Sequence[Event], total: int) -> EventColumns | None:
    """Return events as columns, or None without events. total: number of events since the start, these included."""
    if not events:
        return None
    at, kind, name, bottle, value, text = zip(*events, strict=True)
    ints, floats = np.array(bottle, dtype=np.int64), np.array(value, dtype=np.float64)
    return EventColumns(total, np.array(at, dtype=np.uint64), kind, name, ints, floats, text)


@dataclass(frozen=True)
class GuardEvent:
    """Event of the guard, which watches every tick for motion that is numerically impossible."""

    tick: int
    """Tick at whose end the guard acted; for `stopped`, the last tick that was reached."""
    kind: Literal["shorter_steps", "chatter", "soft", "stopped"]
    bottle: int
    """Bottle ID."""
    x: float
    """Position of the axis, m; for a failed tick, at its start."""
    y: float
    text: str
    """One sentence."""

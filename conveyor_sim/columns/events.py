"""What happens on a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Kind = Literal[
    "bottle_fed",
    "bottle_removed",
    "bottle_rejected",
    "alarm_raised",
    "alarm_cleared",
    "alarm_latched",
    "alarm_acknowledged",
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
    """Something that happened on a line."""

    at: int
    """The tick at which it took effect: of what was given to the line (command, fault, alarm), that at which the scan
    began; of all else, that at which it ended."""
    kind: str
    """One of Kind."""
    name: str
    """Of a bottle's event the device; of a machine's state the signal; else the alarm, fault, command, limit, signal
    that is forced, device whose mode has changed, or controller that has taken the line or given it up."""
    bottle: int
    """Id; -1: none."""
    value: float
    """Of the state, fault, alarm, limit, command, force or mode; 1 for who takes the line, 0 for who gives it up; of a
    bottle's event, how many the device has fed or removed."""
    text: str
    """The reason, or a sentence; empty: nothing to add."""


@dataclass(frozen=True)
class EventColumns:
    """What happened since the tick before, in order; the fields of conveyor_msgs/Events."""

    total: int
    """Since the start of the run, these included."""
    at: NDArray[np.uint64]
    kind: Sequence[str]
    name: Sequence[str]
    bottle: NDArray[np.int64]
    value: NDArray[np.float64]
    text: Sequence[str]


def event_columns(events: Sequence[Event], total: int) -> EventColumns | None:
    """None if nothing happened. total: events since the start, these included."""
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

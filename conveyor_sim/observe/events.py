"""What happens on a line."""

from typing import Literal, NamedTuple

Kind = Literal[
    "bottle_fed",
    "bottle_removed",
    "bottle_rejected",
    "alarm_raised",
    "alarm_cleared",
    "machine_state",
    "fault_injected",
    "fault_cleared",
    "command_refused",
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
    """Of a bottle's event the device; of a machine's state the signal; else the alarm, fault, command or limit."""
    bottle: int
    """Id; -1: none."""
    value: float
    """Of the state, fault, alarm, limit or command; of a bottle's event, how many the device has fed or removed."""
    text: str
    """The reason, or a sentence; empty: nothing to add."""

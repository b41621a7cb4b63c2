"""The process image: all that a controller may read and write, once a tick, by name, with units, types and limits."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

Kind = Literal["bool", "count", "number"]
"""bool: 0 or 1; count: a whole number."""

Role = Literal["", "fed", "removed", "rejected", "state"]
"""What a signal adds to: bottles put onto the line, taken off it, thrown out of it; or whether it is the state of a
machine, each change of which is an event; "": neither."""


@dataclass(frozen=True)
class Signal:
    """What a controller reads: an output of the line."""

    name: str
    unit: str
    """ "1" where it has no dimension."""
    type: Kind
    role: Role = ""


@dataclass(frozen=True)
class Command:
    """What a controller writes, or a fault that a test injects: an input of the line."""

    name: str
    unit: str
    type: Kind
    low: float
    high: float


def switch(name: str) -> Command:
    """An input that is off (0) or on (1)."""
    return Command(name, "1", "bool", 0.0, 1.0)


@dataclass(frozen=True)
class ProcessImage:
    """Three tables by name. Values travel in the order of these tuples."""

    signals: tuple[Signal, ...]
    commands: tuple[Command, ...]
    faults: tuple[Command, ...]
    """Not for controllers: a test injects them."""
    signal_names: tuple[str, ...] = field(init=False)
    command_names: tuple[str, ...] = field(init=False)
    fault_names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        for table in ("signal", "command", "fault"):
            entries: Iterable[Signal | Command] = getattr(self, f"{table}s")
            object.__setattr__(self, f"{table}_names", tuple(entry.name for entry in entries))


def speed_command(belt: str) -> str:
    """Name of a belt's speed setpoint; also the topic that takes it."""
    return f"belts/{belt}/cmd_speed"

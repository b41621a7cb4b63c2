# SPDX-License-Identifier: Apache-2.0
"""`Input`: the record of every external action on a line, and its result.

An input is applied at the start of one tick, or refused as a whole with a reason. One exception: from an input of a
controller, commands without control authority are refused separately. Inputs of one tick are taken in order
of arrival, and names within an input in their order. Each input is checked against the state of the line after the
preceding inputs. Watchdogs act after all inputs, devices after the watchdogs.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple, get_args

from conveyor_sim.errors import CommandError
from conveyor_sim.line.alarms.declaration import as_sent
from conveyor_sim.scene.parts.alarm import PREFIX
from conveyor_sim.scene.types import Unchecked
from conveyor_sim.support.printable import SENTENCE, printable

WriterKind = Literal["controller", "operator", "engineer", "test", "line"]
"""Kind of writer. "line" is the line itself; replay and rerun generate its inputs instead of reading them."""

WRITER_KINDS: tuple[WriterKind, ...] = get_args(WriterKind)

SET = "set"
"""Operation that writes commands by name, and alarms of a controller ("alarms/<name>", 0 or 1)."""

INJECT = "inject"
"""Operation that starts or ends faults by name."""

MODE = "mode"
"""Operation that sets the control mode of each device by name."""

OWN = "own"
"""Operation by which a controller takes ownership of the line; texts: patterns of the devices that it releases."""

DISOWN = "disown"
"""Operation by which the owner releases the line."""

FORCE = "force"
"""Operation that forces signals by name: controllers read its values in place of the measured ones."""

UNFORCE = "unforce"
"""Operation that ends the forcing of signals by name; without names, of all forced signals."""

DECLARE = "declare"
"""Operation that declares alarms of a controller: ids as names, one JSON object per alarm as texts."""

SPAWN = "spawn"
"""Operation that puts bottles on the line: their types as names, six values per bottle (`SPAWN_VALUES`)."""

SPAWN_VALUES = ("x", "y", "theta", "vx", "vy", "omega")
"""Values of one bottle in an input SPAWN, in m, rad, m/s and rad/s, as in conveyor_msgs/Spawn."""

DELETE = "delete"
"""Operation that removes bottles; their ids as values."""

FAULT = "fault"
"""Source of injected faults."""

OPERATE = "operate"
"""Source of operator actions."""

WATCHDOG = "watchdog"
"""Source of stops by a watchdog when a controller sends no more commands."""

ARRIVAL = "arrival"
"""Source of results on inputs that never reached the line. One result may report several inputs."""


class Input(NamedTuple):
    """External action on a line."""

    source: str
    """Route of the input: "commands", "lockstep", "fault", "controller", ..."""
    writer: str
    """Name of the writer."""
    writer_kind: str
    """One of WriterKind."""
    operation: str
    """Name of a row in the line's table of operations."""
    names: tuple[str, ...]
    """Names of tags, alarms or devices, depending on the operation."""
    values: tuple[Unchecked, ...]
    """One value per name if the operation takes numbers."""
    texts: tuple[str, ...] = ()
    """Texts, if the operation takes any."""

    @property
    def by_line(self) -> bool:
        """Return True if the line itself produced the input."""
        return self.writer_kind == "line"


@dataclass(frozen=True)
class CommandOutcome:
    """Result of one input; conveyor_msgs/CommandOutcome."""

    tick: int
    """The input was applied at the start of the scan that leads from this tick to the next."""
    input: Input
    """The input; if it was refused, its names are escaped and shortened for display."""
    accepted: bool
    reason: str
    """Reason for a refusal, "" if accepted."""
    without_control: bool = False
    """True if the writer has no control authority: another control mode is set, or another controller owns the line."""
    part: bool = False
    """True if only this part of the input was refused; the rest has a separate result."""
    repeated: bool = False
    """True if an equal refusal was already reported since the last change of control authority."""
    bottles: tuple[int, ...] = ()
    """Ids of the bottles that an input SPAWN put on the line, in the order of its names."""

    @property
    def source(self) -> str:
        """Route of the input."""
        return self.input.source

    @property
    def operation(self) -> str:
        """Operation of the input."""
        return self.input.operation

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the input."""
        return self.input.names

    @property
    def values(self) -> tuple[float, ...]:
        """Values in the input."""
        return self.input.values


def normalized(request: Input) -> Input:
    """Return an input with its texts escaped, and shortened where they are too long, for display and for replays.

    Names of commands stay as they are, because unknown ones are refused. Raise CommandError for a field of another
    type.
    """
    try:
        return _normalized(request)
    except (AttributeError, OverflowError, TypeError, ValueError):
        if (wrong := _of_wrong_type(request)) is None:
            raise
        raise CommandError(wrong) from None


def _normalized(request: Input) -> Input:
    source, writer, kind, operation, names, values, texts = request
    # Names of commands and faults stay, because unknown ones are refused. Writers choose the names of alarms.
    normal = _normal_names(tuple(names), operation not in (SET, INJECT))
    numbers = tuple([float(value) for value in values])
    if texts:
        texts = tuple(as_sent(text) if operation == DECLARE else printable(text, SENTENCE) for text in texts)
    source = printable(source)
    writer = source if writer == source else printable(writer)
    return Input(source, writer, printable(kind), printable(operation), normal, numbers, texts)


@lru_cache(maxsize=16)
def _normal_names(names: tuple[str, ...], foreign: bool) -> tuple[str, ...]:
    """Return names with those of alarms escaped, or all of them. Cached, because a controller repeats its names."""
    return tuple(printable(name) if foreign or name.startswith(PREFIX) else name for name in names)


def _of_wrong_type(request: Input) -> str | None:
    """Return an error message for the first name, text or value of a wrong type; None if all types are correct."""
    for field, texts in (("names", request.names), ("texts", request.texts)):
        for text in texts:
            if not isinstance(text, str):
                return f"{field}: {printable(repr(text))} given, expected a text"
    for index, value in enumerate(request.values):
        try:
            float(value)
        except (OverflowError, TypeError, ValueError):
            name = request.names[index] if index < len(request.names) else request.operation
            return f"{printable(name)}: {printable(repr(value))} given, expected a number"
    return None


def recorded_input(source: str, names: tuple[str, ...], values: tuple[float, ...]) -> Input:
    """Return the input of a result in an old recording. Such a result has no writer or operation; both follow from
    its source.
    """
    if source == FAULT:
        return Input(source, source, "test", INJECT, names, values)
    kind = "line" if source in (WATCHDOG, ARRIVAL) else "controller"
    return Input(source, source, kind, SET, names, values)


def arrival(reason: str, tick: int) -> CommandOutcome:
    """Return a result that reports inputs which never reached the line."""
    return CommandOutcome(tick, Input(ARRIVAL, ARRIVAL, "line", SET, (), ()), False, reason)

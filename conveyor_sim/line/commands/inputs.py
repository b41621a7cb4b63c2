"""`Input`: the one record of whatever acts on a line from outside, and what became of it.

An input belongs to a tick: the one at whose beginning it is applied, or refused with the reason, as a whole. Those of
one tick are taken in the order in which they were given, and within one the names in their order: each is judged as the
line stands after those before it. Watchdogs act after all inputs, devices after the watchdogs.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from conveyor_sim.errors import CommandError
from conveyor_sim.line.alarms.declaration import as_sent
from conveyor_sim.scene.parts.alarm import PREFIX
from conveyor_sim.scene.types import Unchecked
from conveyor_sim.support.printable import SENTENCE, printable

WriterKind = Literal["controller", "operator", "engineer", "test", "line"]
"""Who acts; "line": the line itself, which replay and rerun bring about again without being given it."""

WRITER_KINDS: tuple[WriterKind, ...] = get_args(WriterKind)

SET = "set"
"""Operation: commands by name, and alarms of a controller ("alarms/<name>", 0 or 1)."""

INJECT = "inject"
"""Operation: faults by name."""

MODE = "mode"
"""Operation: devices by name, and the mode that each gets."""

OWN = "own"
"""Operation: a controller takes the line; texts: patterns of devices that it leaves to others."""

DISOWN = "disown"
"""Operation: it gives the line up."""

FORCE = "force"
"""Operation: signals by name, and what controllers read in place of their values."""

UNFORCE = "unforce"
"""Operation: signals by name; none: all that are forced."""

DECLARE = "declare"
"""Operation: alarms of a controller, ids as names and a JSON object each as texts."""

FAULT = "fault"
"""Source of faults."""

OPERATE = "operate"
"""Source of what an operator does."""

WATCHDOG = "watchdog"
"""Source of what the line does for a controller that has gone silent."""

ARRIVAL = "arrival"
"""Source of outcomes that report inputs which never reached the line, many in one."""


class Input(NamedTuple):
    """Something that acts on a line."""

    source: str
    """By which way it came: "commands", "lockstep", "fault", "controller", ..."""
    writer: str
    """Who gave it, by name."""
    writer_kind: str
    """One of WriterKind."""
    operation: str
    """What is done: a row in the line's table of operations."""
    names: tuple[str, ...]
    """Of tags, alarms or devices, as the operation has it."""
    values: tuple[Unchecked, ...]
    """One for each name where the operation takes numbers."""
    texts: tuple[str, ...] = ()
    """Where it takes texts."""

    @property
    def by_line(self) -> bool:
        """Whether the line itself brought it about."""
        return self.writer_kind == "line"


@dataclass(frozen=True)
class CommandOutcome:
    """What became of one input; conveyor_msgs/CommandOutcome."""

    tick: int
    """Applied at the start of the scan that leads from this tick to the next."""
    input: Input
    """With names fit to be repeated, if it was refused."""
    accepted: bool
    reason: str
    """Empty if accepted."""
    without_control: bool = False
    """Refused because its writer has no control there: the device is in other hands, or the line has another owner."""
    part: bool = False
    """It is what was taken out of an input for that; the rest has an outcome of its own."""
    repeated: bool = False
    """Such a refusal was reported before, since hands last changed."""

    @property
    def source(self) -> str:
        """By which way it came."""
        return self.input.source

    @property
    def operation(self) -> str:
        """What was to be done."""
        return self.input.operation

    @property
    def names(self) -> tuple[str, ...]:
        """Of what it was about."""
        return self.input.names

    @property
    def values(self) -> tuple[float, ...]:
        """That were given."""
        return self.input.values


def as_kept(given: Input) -> Input:
    """An input as it can be shown, and as a replay will find it: what does not print is escaped, what is too long cut.

    Commands are not: a name that is none of the line's is refused as it is. Raises CommandError for what is of another
    type than its field.
    """
    try:
        return _kept(given)
    except (AttributeError, OverflowError, TypeError, ValueError):
        if (wrong := _of_wrong_type(given)) is None:
            raise
        raise CommandError(wrong) from None


def _kept(given: Input) -> Input:
    source, writer, kind, operation, names, values, texts = given
    # Whoever names an alarm makes it up.
    alarms = operation not in (SET, INJECT)
    kept = tuple([printable(name) if alarms or name.startswith(PREFIX) else name for name in names])
    numbers = tuple([float(value) for value in values])
    if texts:
        texts = tuple(as_sent(text) if operation == DECLARE else printable(text, SENTENCE) for text in texts)
    source = printable(source)
    writer = source if writer == source else printable(writer)
    return Input(source, writer, printable(kind), printable(operation), kept, numbers, texts)


def _of_wrong_type(given: Input) -> str | None:
    """What of an input is no text or no number, in words; None: nothing."""
    for field, texts in (("names", given.names), ("texts", given.texts)):
        for text in texts:
            if not isinstance(text, str):
                return f"{field}: {printable(repr(text))} given, expected a text"
    for index, value in enumerate(given.values):
        try:
            float(value)
        except (OverflowError, TypeError, ValueError):
            name = given.names[index] if index < len(given.names) else given.operation
            return f"{printable(name)}: {printable(repr(value))} given, expected a number"
    return None


def recorded_input(source: str, names: tuple[str, ...], values: tuple[float, ...]) -> Input:
    """The input of an outcome from before writers and operations were recorded: its source says enough."""
    if source == FAULT:
        return Input(source, source, "test", INJECT, names, values)
    kind = "line" if source in (WATCHDOG, ARRIVAL) else "controller"
    return Input(source, source, kind, SET, names, values)


def arrival(reason: str, tick: int) -> CommandOutcome:
    """The report of inputs that never reached the line, before a tick."""
    return CommandOutcome(tick, Input(ARRIVAL, ARRIVAL, "line", SET, (), ()), False, reason)

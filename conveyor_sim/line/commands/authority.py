"""Who may do what to a line: one table by operation, and one by mode for commands."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import (
    DISOWN,
    FORCE,
    INJECT,
    MODE,
    OWN,
    SET,
    UNFORCE,
    WRITER_KINDS,
    Input,
    WriterKind,
)
from conveyor_sim.support.printable import printable

PEOPLE: tuple[WriterKind, ...] = ("operator", "engineer")
"""Those who act through the service `operate`."""


class Right(NamedTuple):
    """Who may use one operation."""

    writers: tuple[WriterKind, ...]
    what: str
    """What it does, in a sentence for docs/line.md."""


MAY: Mapping[str, Right] = {
    SET: Right(("controller", *PEOPLE, "test"), "Sets commands, in the modes above; says alarms."),
    INJECT: Right(("test",), "Has faults begin or end."),
    MODE: Right((*PEOPLE, "test"), "Puts devices (names) into modes (values)."),
    OWN: Right(("controller",), "Takes the line, but for the devices that texts name by patterns."),
    DISOWN: Right(("controller",), "Gives it up."),
    FORCE: Right((*PEOPLE, "test"), "Forces signals to values."),
    UNFORCE: Right((*PEOPLE, "test"), "Ends that, without names for all."),
    "acknowledge": Right((*PEOPLE, "test"), "Acknowledges alarms, without names all."),
    "reset": Right((*PEOPLE, "test"), "Clears latched alarms, without names all."),
    "shelve": Right((*PEOPLE, "test"), "Shelves alarms for so many seconds (values), or once."),
    "unshelve": Right((*PEOPLE, "test"), "Ends that, without names for all."),
    "remove_from_service": Right(("engineer", "test"), "Takes alarms out of service."),
    "return_to_service": Right(("engineer", "test"), "Ends that."),
    "declare": Right(("controller", "test"), "Declares a controller's alarms."),
    "reset_counters": Right(("controller", *PEOPLE, "test"), "Counters and times of devices, or of all, begin anew."),
}
"""By operation; what is not here, nobody may."""

AUTOMATIC, MAINTENANCE, MANUAL = 1, 2, 3

MODES: Mapping[int, str] = {AUTOMATIC: "Automatic", MAINTENANCE: "Maintenance", MANUAL: "Manual"}
"""By the numbers of PackML's unit modes, where 1 is Production."""

IN_CONTROL: Mapping[int, tuple[WriterKind, ...]] = {
    AUTOMATIC: ("controller", "test"),
    MAINTENANCE: ("engineer", "test"),
    MANUAL: (*PEOPLE, "test"),
}
"""Whose commands a device takes, by its mode."""

OPERATORS_MODES = (AUTOMATIC, MANUAL)
"""Between which an operator may switch; engineers and tests between all."""


MAY_SET: Mapping[str, tuple[int, ...]] = {
    "operator": OPERATORS_MODES,
    "engineer": tuple(MODES),
    "test": tuple(MODES),
}
"""Modes by kind of writer: a device must be in one of them, and can be put into one of them."""

MOST_PATTERNS = 1000
"""Patterns of devices in one input."""


def reserved_mode(kind: str, modes: Iterable[float]) -> float | None:
    """Return the first mode that a kind of writer may not set; None if it may set all of them."""
    return next((mode for mode in modes if mode not in MAY_SET.get(kind, ())), None)


def reserved(device: str, kind: str, mode: float) -> str:
    """Return why a kind of writer can't put a device into such a mode, or out of it."""
    return f"{device}: {MODES[int(mode)]} is not for {kind}s, expected an engineer"


def covers(pattern: str, device: str, where: str) -> bool:
    """Return True if a pattern fits a device, by its name or by its path. where: the line's place in the plant."""
    return fnmatchcase(device, pattern) or fnmatchcase(f"{where}/{device}", pattern)


def pattern_problem(patterns: Sequence[str], devices: Collection[str], where: str) -> str:
    """Return why devices can't be released by these patterns, "" if they can. devices: that take commands."""
    if len(patterns) > MOST_PATTERNS:
        return f"{len(patterns)} patterns given, expected {MOST_PATTERNS} at most"
    for pattern in patterns:
        if not any(covers(pattern, device, where) for device in devices):
            some = ", ".join(list(devices)[:5]) or "none: there are none"
            return f"{printable(pattern)}: fits no device that takes commands, expected such as {some}"
    return ""


def hand_over_problem(given: Input) -> str:
    """Return why such an input can't take or release the line, whichever controller owns it; "" if it can."""
    if given.names or given.values or (given.texts and given.operation == DISOWN):
        expected = "texts alone, patterns of devices" if given.operation == OWN else "nothing beside its writer"
        return f"{len(given.names)} names, {len(given.values)} values, {len(given.texts)} texts, expected {expected}"
    return "" if given.writer else "no writer given, expected the name of a controller"


def unauthorized(given: Input, operations: Collection[str]) -> str:
    """Why nobody of this kind may do this, whatever to, "" if it may. operations: those that there are."""
    if given.writer_kind not in WRITER_KINDS:
        return f"{printable(given.writer_kind)}: no such kind of writer, expected one of {', '.join(WRITER_KINDS)}"
    if given.operation not in operations:
        return f"{printable(given.operation)}: no such operation, expected one of {', '.join(operations)}"
    kinds = MAY[given.operation].writers if given.operation in MAY else ()
    if given.writer_kind in kinds:
        return ""
    return f"{given.operation}: given by {who(given)}, expected one of the kind {' or '.join(kinds)}"


def who(given: Input) -> str:
    """Who gave an input, in words: "operator Jo"."""
    name = printable(given.writer)
    return given.writer_kind if name in ("", given.writer_kind) else f"{given.writer_kind} {name}"

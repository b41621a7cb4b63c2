# SPDX-License-Identifier: Apache-2.0
"""Rights to act on a line: one table of operations by kind of writer, and one of control modes for commands."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import (
    DELETE,
    DISOWN,
    FORCE,
    INJECT,
    MODE,
    OWN,
    SET,
    SPAWN,
    UNFORCE,
    WRITER_KINDS,
    Input,
    WriterKind,
)
from conveyor_sim.support.printable import printable

PEOPLE: tuple[WriterKind, ...] = ("operator", "engineer")
"""Kinds of writer that are persons. They act through the ROS service `operate` or a protocol server."""


class Right(NamedTuple):
    """Right to use one operation."""

    writers: tuple[WriterKind, ...]
    what: str
    """Description of the operation, one sentence for docs/line.md."""


MAY: Mapping[str, Right] = {
    SET: Right(("controller", *PEOPLE, "test"), "Sets commands, in the modes above; sets and clears alarms."),
    INJECT: Right(("test",), "Starts or ends faults."),
    MODE: Right((*PEOPLE, "test"), "Puts devices (names) into modes (values)."),
    OWN: Right(("controller",), "Takes the line, except devices that match the patterns in texts."),
    DISOWN: Right(("controller",), "Releases ownership."),
    FORCE: Right((*PEOPLE, "test"), "Forces signals to values."),
    UNFORCE: Right((*PEOPLE, "test"), "Ends forcing of the named signals; of all if no names are given."),
    "acknowledge": Right((*PEOPLE, "test"), "Acknowledges the named alarms; all if no names are given."),
    "confirm": Right((*PEOPLE, "test"), "Confirms the named acknowledged alarms; all that wait if no names are given."),
    "reset": Right((*PEOPLE, "test"), "Clears the named latched alarms; all if no names are given."),
    "shelve": Right((*PEOPLE, "test"), "Shelves alarms for a time in seconds (values), or once."),
    "unshelve": Right((*PEOPLE, "test"), "Ends shelving of the named alarms; of all if no names are given."),
    "remove_from_service": Right(("engineer", "test"), "Takes alarms out of service."),
    "return_to_service": Right(("engineer", "test"), "Returns alarms to service."),
    "declare": Right(("controller", "test"), "Declares a controller's alarms."),
    "reset_counters": Right(
        ("controller", *PEOPLE, "test"), "Resets counters and times of the named devices; of all if no names are given."
    ),
    SPAWN: Right(
        ("controller", *PEOPLE, "test"),
        "Puts bottles on the line: types as names, position and motion as values.",
    ),
    DELETE: Right(("controller", *PEOPLE, "test"), "Removes the bottles with the IDs in values."),
}
"""Rights by operation. An operation that is not listed is forbidden."""

AUTOMATIC, MAINTENANCE, MANUAL = 1, 2, 3

MODES: Mapping[int, str] = {AUTOMATIC: "Automatic", MAINTENANCE: "Maintenance", MANUAL: "Manual"}
"""Text by number of PackML's unit modes, where 1 is Production."""

IN_CONTROL: Mapping[int, tuple[WriterKind, ...]] = {
    AUTOMATIC: ("controller", "test"),
    MAINTENANCE: ("engineer", "test"),
    MANUAL: (*PEOPLE, "test"),
}
"""Kinds of writer whose commands a device accepts, by its mode."""

AT_PANEL: tuple[WriterKind, ...] = (*PEOPLE, "test")
"""Kinds of writer that use the inputs of the panel, in every control mode and whichever controller owns the line."""

OPERATORS_MODES = (AUTOMATIC, MANUAL)
"""Modes between which an operator may switch. Engineers and tests may switch between all modes."""


MAY_SET: Mapping[str, tuple[int, ...]] = {
    "operator": OPERATORS_MODES,
    "engineer": tuple(MODES),
    "test": tuple(MODES),
}
"""Modes by kind of writer. The present mode of a device and the new one must both be listed."""

MOST_PATTERNS = 1000
"""Largest number of device patterns in one input."""


def reserved_mode(kind: str, modes: Iterable[float]) -> float | None:
    """Return the first mode that a kind of writer may not set; None if it may set all of them."""
    return next((mode for mode in modes if mode not in MAY_SET.get(kind, ())), None)


def advice(kind: WriterKind) -> str:
    """Return what lets a kind of writer command a device that is in another mode."""
    modes = [text for number, text in MODES.items() if kind in IN_CONTROL[number]]
    return f"set its mode to {modes[-1]} first" if kind in PEOPLE else f"expected {' or '.join(modes)}"


def reserved(device: str, kind: str, mode: float) -> str:
    """Return why a kind of writer may not switch a device to or from a mode."""
    return f"{device}: {MODES[int(mode)]} is not for {kind}s, expected an engineer"


def panel_problem(request: Input, panel: Collection[str]) -> str:
    """Return why this kind of writer may not set the inputs of the panel in a request; "" if it may.

    panel: names of these inputs.
    """
    if request.writer_kind in AT_PANEL:
        return ""
    name = next((name for name in request.names if name in panel), None)
    if name is None:
        return ""
    expected = f"expected one of the kind {' or '.join(AT_PANEL)}"
    return f"{name}: is an input of the panel, given by {who(request)}, {expected}"


def covers(pattern: str, device: str, where: str) -> bool:
    """Return True if a pattern fits a device, by its name or by its path. where: the line's place in the plant."""
    return fnmatchcase(device, pattern) or fnmatchcase(f"{where}/{device}", pattern)


def pattern_problem(patterns: Sequence[str], devices: Collection[str], where: str) -> str:
    """Return why devices can't be released by these patterns, "" if they can.

    devices: names of the devices that take commands.
    """
    if len(patterns) > MOST_PATTERNS:
        return f"{len(patterns)} patterns given, expected {MOST_PATTERNS} at most"
    for pattern in patterns:
        if not any(covers(pattern, device, where) for device in devices):
            some = ", ".join(list(devices)[:5])
            expected = f"expected such as {some}" if some else "and the line has none"
            return f"{printable(pattern)}: fits no device that takes commands, {expected}"
    return ""


def hand_over_problem(request: Input) -> str:
    """Return why an OWN or DISOWN input is invalid for any owner of the line; "" if it is valid."""
    if request.names or request.values or (request.texts and request.operation == DISOWN):
        expected = "texts alone, patterns of devices" if request.operation == OWN else "nothing beside its writer"
        counts = f"{len(request.names)} names, {len(request.values)} values, {len(request.texts)} texts"
        return f"{counts} given, expected {expected}"
    return "" if request.writer else "no writer given, expected the name of a controller"


def unauthorized(request: Input, operations: Collection[str]) -> str:
    """Return why this kind of writer may not use the operation at all, "" if it may.

    operations: those of the line.
    """
    if request.writer_kind not in WRITER_KINDS:
        return f"{printable(request.writer_kind)}: no such kind of writer, expected one of {', '.join(WRITER_KINDS)}"
    if request.operation not in operations:
        return f"{printable(request.operation)}: no such operation, expected one of {', '.join(operations)}"
    kinds = MAY[request.operation].writers if request.operation in MAY else ()
    if request.writer_kind in kinds:
        return ""
    return f"{request.operation}: given by {who(request)}, expected one of the kind {' or '.join(kinds)}"


def who(request: Input) -> str:
    """Return the writer of an input in words, such as "operator Jo"."""
    name = printable(request.writer)
    return request.writer_kind if name in ("", request.writer_kind) else f"{request.writer_kind} {name}"

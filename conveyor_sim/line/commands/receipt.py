# SPDX-License-Identifier: Apache-2.0
"""`Receipt`: checks on receipt of an input, independent of the state of the line.

Protocol servers answer clients by these checks at once. The line checks again at the tick, by the same rules.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from conveyor_sim.columns.counters import LINE
from conveyor_sim.line.alarms.operations import OPERATIONS as ALARM_OPERATIONS
from conveyor_sim.line.alarms.operations import argument_problem
from conveyor_sim.line.commands.authority import (
    MAY,
    hand_over_problem,
    panel_problem,
    pattern_problem,
    reserved,
    reserved_mode,
    unauthorized,
)
from conveyor_sim.line.commands.inputs import DISOWN, FORCE, INJECT, MODE, OWN, SET, UNFORCE, Input
from conveyor_sim.line.commands.refusal import ALARMS, moved_belts, refusal
from conveyor_sim.line.tag import COMMANDS, PANEL, SIGNALS, Tag
from conveyor_sim.support.printable import printable

Cause = Literal["operation", "role", "name", "value", "form"]
"""Cause of a refusal. operation: not allowed for this kind of writer. role: this value is not allowed for it.
name: unknown. value: out of range, or of a wrong kind. form: any other defect of the input.
"""

RESET_COUNTERS = "reset_counters"

COUNTING = ("carousel", "infeed", "inspection", "outfeed", "reject", "sink", "source", "station")
"""Classes of devices that have counters which can be reset."""


class Refusal(NamedTuple):
    """Why an input can never be applied."""

    cause: Cause
    reason: str


class Receipt:
    """Checks of the inputs of one line."""

    def __init__(self, tags: Sequence[Tag], where: str) -> None:
        """Build the tables of the checks. tags: all tags of the line. where: path of the line in the plant."""
        self._where = where
        modes = {tag.device: tag for tag in tags if tag.device and tag.name == f"{tag.device}/mode"}
        signals = {tag.name: tag.without_limits() for tag in tags if tag.role in SIGNALS}
        self._tables: Mapping[str, tuple[str, Mapping[str, Tag]]] = {
            SET: ("command", {tag.name: tag for tag in tags if tag.role in COMMANDS}),
            INJECT: ("fault", {tag.name: tag for tag in tags if tag.role == "fault"}),
            MODE: ("device", modes),
            FORCE: ("signal", signals),
        }
        """Tags that an operation may name, with the word for one of them, by operation."""
        self._moved = moved_belts(tags)
        self._panel = frozenset(tag.name for tag in tags if tag.role == PANEL)
        self._counting = {LINE, *(tag.device for tag in tags if tag.device_class in COUNTING)}

    def refusal(self, request: Input) -> Refusal | None:
        """Return why an input is invalid in every state of the line; None if it may be valid in some state."""
        operation, names, values = request.operation, request.names, request.values
        if reason := unauthorized(request, MAY):
            return Refusal("operation", reason)
        if request.texts and operation in (*self._tables, UNFORCE, RESET_COUNTERS):
            return Refusal("form", f"{len(request.texts)} texts given, expected none")
        if operation in self._tables:
            return self._table_refusal(request)
        if operation == UNFORCE:
            return _values_refusal(values) or _unknown(self._tables[FORCE][1], "signal", names)
        if operation == RESET_COUNTERS:
            return _values_refusal(values) or _unknown(self._counting, "device that counts", names)
        if operation in (OWN, DISOWN):
            if reason := hand_over_problem(request):
                return Refusal("form", reason)
            reason = pattern_problem(request.texts, self._tables[MODE][1], self._where)
            return Refusal("name", reason) if reason else None
        if operation in ALARM_OPERATIONS and (reason := argument_problem(operation, names, values)):
            return Refusal("value" if names and len(values) == len(names) else "form", reason)
        return None

    def _table_refusal(self, request: Input) -> Refusal | None:
        what, known = self._tables[request.operation]
        names, values = request.names, request.values
        if reason := refusal(known, what, names, values, self._moved):
            return Refusal(_cause(known, what, names, values), reason)
        if request.operation == SET and (reason := panel_problem(request, self._panel)):
            return Refusal("role", reason)
        for device, mode in zip(names, values, strict=True) if request.operation == MODE else ():
            if reserved_mode(request.writer_kind, [mode]) is not None:
                return Refusal("role", reserved(device, request.writer_kind, mode))
        return None


def _cause(known: Mapping[str, Tag], what: str, names: Sequence[str], values: Sequence[float]) -> Cause:
    """Return the cause of an objection of `refusal`."""
    if not names or len(names) != len(values) or len(set(names)) != len(names):
        return "form"
    unknown = any(name not in known and (what != "command" or not name.startswith(ALARMS)) for name in names)
    return "name" if unknown else "value"


def _values_refusal(values: Sequence[float]) -> Refusal | None:
    return Refusal("form", f"{len(values)} values given, expected none") if values else None


def _unknown(known: Mapping[str, Tag] | set[str], what: str, names: Sequence[str]) -> Refusal | None:
    for place, name in enumerate(names):
        if name not in known:
            return Refusal("name", f"{printable(name)}: no such {what}")
        if what == "signal" and name in names[:place]:
            return Refusal("form", f"{name}: given twice")
    return None

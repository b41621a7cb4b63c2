"""`PageCommands`: requests of pages, checked at once as far as possible and passed on to the tag provider.

Nothing here waits for a tick. What the line refuses at the tick is among its events, which pages receive as well.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

from conveyor_sim.line.commands.authority import MAY, unauthorized
from conveyor_sim.line.commands.inputs import DECLARE, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Receipt
from conveyor_sim.line.tag import COMMANDS, Tag
from conveyor_sim.protocols.server.users import Role
from conveyor_sim.protocols.tags.control_mode import MAY_CONTROL, TAKES_NO_INPUT, objection, refused_for_good
from conveyor_sim.protocols.tags.line_mirror import DrawableProvider
from conveyor_sim.protocols.tags.tag_provider import WEB

OPERATIONS = tuple(operation for operation in MAY if operation != DECLARE)

MOST_NAMES, LONGEST_NAME = 100, 200
"""Largest number of names in one request, and of characters in a name."""

LARGEST = sys.float_info.max
"""Largest absolute value in a request."""


class PageUser(NamedTuple):
    """User of a page."""

    name: str = ""
    """Name; empty: not signed in."""
    role: Role = "viewer"
    kind: WriterKind | None = None
    """Kind of writer for the line; None: the user only reads."""

    @property
    def writer(self) -> str:
        """Name of the writer in recorded inputs."""
        return f"{WEB} {self.name}"


ANONYMOUS = PageUser()


class PageCommands:
    """Requests of all pages of one tag provider."""

    def __init__(self, source: DrawableProvider) -> None:
        self._source = source
        tags = source.info.tags
        self._commands: Mapping[str, Tag] = {tag.name: tag for tag in tags if tag.role in COMMANDS}
        self._receipt = Receipt(tags, source.info.where)
        self.controls = source.controls - {"target"}  # the controller sets the target of a line in lockstep
        """Requests to control the run that pages may make."""
        self.writes = self.refused = 0
        """Requests that were passed on to the line, and requests that were refused."""

    def do(self, person: PageUser, request: Mapping[str, Any]) -> str:
        """Carry out a request of a page, which may be malformed. Return the reason for a refusal, "" if it was
        accepted.
        """
        reason = self._do(person, request)
        self.writes, self.refused = self.writes + (not reason), self.refused + bool(reason)
        return reason

    def _do(self, person: PageUser, request: Mapping[str, Any]) -> str:
        if person.kind is None:
            who = f"{person.name} is a viewer, who only reads" if person.name else "not signed in"
            return f"{who}; expected an operator, engineer, controller or test"
        what, names, values = request.get("do"), request.get("names", []), request.get("values", [])
        if not (_are(names, str) and _are(values, (int, float)) and all(abs(value) <= LARGEST for value in values)):
            return f"expected at most {MOST_NAMES} names and finite values"
        if not all(len(name) <= LONGEST_NAME and name.isprintable() for name in names):
            return f"expected names of at most {LONGEST_NAME} characters that print"
        if what == "control":
            return self._control(person, person.kind, names, values)
        if not isinstance(what, str):
            return f"expected one of {', '.join(OPERATIONS)}"
        return self._give(Input(WEB, person.writer, person.kind, what, tuple(names), tuple(map(float, values))))

    def _control(self, person: PageUser, kind: WriterKind, names: list[str], values: list[float]) -> str:
        if kind not in MAY_CONTROL:
            return f"{person.name} is a {kind}, expected one of the kind {' or '.join(MAY_CONTROL)}"
        (what,) = names[:1] or ("",)
        (control,) = [known for known in self.controls if known == what] or (None,)
        if control is None:
            return f"expected one of {', '.join(sorted(self.controls)) or 'nothing'}"
        return self._source.control(control, float(values[0]) if values else 0.0, f"{kind} {person.writer}")

    def _give(self, request: Input) -> str:
        if reason := unauthorized(request, OPERATIONS):
            return reason
        if refusal := refused_for_good(self._source, self._receipt, request):
            return refusal.reason
        snapshot = self._source.snapshot
        if snapshot.lost:
            return snapshot.lost
        if snapshot.run.state in TAKES_NO_INPUT:
            return f"the run is {snapshot.run.text}, expected one that goes on"
        if request.operation == SET and (reason := self._objection(request)):
            return reason
        return self._source.give(request)

    def _objection(self, request: Input) -> str:
        """Return why commands would be refused in the latest state of the line; "" if they would not."""
        if unknown := [name for name in request.names if name not in self._commands]:
            return f"{unknown[0]}: expected a command"
        kind: Any = request.writer_kind
        reasons = (
            objection(self._source, self._commands[name], value, kind, request.writer)
            for name, value in zip(request.names, request.values, strict=True)
        )
        return next(filter(None, reasons), "")


def _are(values: Any, kind: Any) -> bool:
    """Return True for a list of at most MOST_NAMES values of a kind, bool excluded."""
    if not isinstance(values, list) or len(values) > MOST_NAMES:
        return False
    return all(isinstance(value, kind) and not isinstance(value, bool) for value in values)

"""`PageCommands`: what pages want of a line, judged at once as far as that is possible, and handed to its source.

Nothing here waits for a tick. What the line refuses then is among its events, which the page is told of, too.
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
"""Of one request, and characters of each."""

LARGEST = sys.float_info.max
"""Of values."""


class PageUser(NamedTuple):
    """Who sits before a page."""

    name: str = ""
    """Empty: nobody who has said so."""
    role: Role = "viewer"
    kind: WriterKind | None = None
    """As what they act on a line; None: they don't."""

    @property
    def writer(self) -> str:
        """As inputs are recorded."""
        return f"{WEB} {self.name}"


NOBODY = PageUser()


class PageCommands:
    """Of all pages of one source."""

    def __init__(self, source: DrawableProvider) -> None:
        self._source = source
        tags = source.about.tags
        self._commands: Mapping[str, Tag] = {tag.name: tag for tag in tags if tag.role in COMMANDS}
        self._receipt = Receipt(tags, source.about.where)
        self.controls = source.controls - {"target"}  # how far a line in lockstep goes is its controller's affair
        """What can be asked of the run from a page."""
        self.writes = self.refused = 0
        """Requests that were passed on to the line, and those that were not."""

    def do(self, person: PageUser, request: Mapping[str, Any]) -> str:
        """What a page asks for; why that can't be, "" if it will be done. It may be anything."""
        reason = self._do(person, request)
        self.writes, self.refused = self.writes + (not reason), self.refused + bool(reason)
        return reason

    def _do(self, person: PageUser, request: Mapping[str, Any]) -> str:
        if person.kind is None:
            who = f"{person.name} is a viewer, who only reads" if person.name else "nobody has signed in"
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

    def _give(self, given: Input) -> str:
        if reason := unauthorized(given, OPERATIONS):
            return reason
        if refusal := refused_for_good(self._source, self._receipt, given):
            return refusal.reason
        shown = self._source.shown
        if shown.lost:
            return shown.lost
        if shown.run.state in TAKES_NO_INPUT:
            return f"the run is {shown.run.text}, expected one that goes on"
        if given.operation == SET and (reason := self._objection(given)):
            return reason
        return self._source.give(given)

    def _objection(self, given: Input) -> str:
        """Why commands are refused, as the line was last."""
        if unknown := [name for name in given.names if name not in self._commands]:
            return f"{unknown[0]}: expected a command"
        kind: Any = given.writer_kind
        found = (
            objection(self._source, self._commands[name], value, kind, given.writer)
            for name, value in zip(given.names, given.values, strict=True)
        )
        return next(filter(None, found), "")


def _are(values: Any, kind: Any) -> bool:
    """Whether it is a list of those, not too long."""
    if not isinstance(values, list) or len(values) > MOST_NAMES:
        return False
    return all(isinstance(value, kind) and not isinstance(value, bool) for value in values)

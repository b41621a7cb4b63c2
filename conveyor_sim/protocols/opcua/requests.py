# SPDX-License-Identifier: Apache-2.0
"""`Requests`: requests of clients, checked at once as far as possible and passed on to the tag provider.

Nothing here waits for a tick. The result is in the read-back of each command, and in events.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole

from conveyor_sim.line.commands.authority import MAY, unauthorized
from conveyor_sim.line.commands.inputs import MODE, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Cause, Receipt
from conveyor_sim.line.tag import COMMANDS, Tag
from conveyor_sim.protocols.opcua.nodes import name_of
from conveyor_sim.protocols.opcua.reasons import ReasonedCode, as_status
from conveyor_sim.protocols.opcua.values import type_of
from conveyor_sim.protocols.tags.control_mode import (
    CONTROL_RANGES,
    MAY_CONTROL,
    TAKES_NO_INPUT,
    is_mode,
    objection,
    refused_for_good,
)
from conveyor_sim.protocols.tags.handshake import MAY_GO_ON, TARGET
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.tag_provider import OPCUA, Control, TagProvider

Codes = ua.StatusCodes

CODES: Mapping[Cause, int] = {
    "operation": Codes.BadUserAccessDenied,
    "role": Codes.BadUserAccessDenied,
    "name": Codes.BadNodeIdUnknown,
    "value": Codes.BadOutOfRange,
    "form": Codes.BadInvalidArgument,
}
"""Status code by cause of refusal, for inputs that are invalid in every state of the line."""


@dataclass
class Client(User):
    """User of a session."""

    kind: WriterKind | None = None
    """Kind of writer for the line; None: the user only reads."""

    @property
    def writer(self) -> str:
        """Name of the writer in recorded inputs."""
        return f"{OPCUA} {self.name}"


def reader(name: str = "") -> Client:
    """Return a user who only reads."""
    return Client(UserRole.User, name)


class Requests:
    """Requests of all clients of one tag provider."""

    def __init__(self, source: TagProvider) -> None:
        self._source = source
        self._receipt = Receipt(source.info.tags, source.info.where)
        self._commands: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags if tag.role in COMMANDS}
        self._modes: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags if is_mode(tag)}
        self.held = HeldButtons(source)
        """Buttons that clients hold, by the identity of their users (`Client`)."""
        self.writes = self.refused = 0
        """Requests that were passed on to the line, and requests that were refused."""

    def write(self, client: User, values: Sequence[ua.WriteValue]) -> list[ua.StatusCode]:
        """Return one status per write. Accepted writes are queued together as one input."""
        codes: list[int] = []
        together: dict[str, float] = {}
        places: list[int] = []
        for place, value in enumerate(values):
            name = name_of(value.NodeId)
            if name == TARGET or name in self._modes:
                self._flush(client, together, places, codes)
                codes.append(self._go_on(client, value) if name == TARGET else self._set_mode(client, value))
                continue
            code, number = self._judge(client, value)
            if name in together:
                self._flush(client, together, places, codes)
            if code == Codes.Good:
                together[name] = number
                places.append(place)
            codes.append(code)
        self._flush(client, together, places, codes)
        self.writes += (accepted := codes.count(Codes.GoodCompletesAsynchronously))
        self.refused += len(codes) - accepted
        return [as_status(code) for code in codes]

    def write_together(self, client: User, names: Sequence[str], values: Sequence[float]) -> int:
        """Queue commands as one input, all or none.

        Return a status code; the caller counts the request. Each name occurs once.
        """
        tags = [self._commands[name] for name in names]
        codes = [self._judge_number(client, tag, value) for tag, value in zip(tags, values, strict=True)]
        bad = next((code for code in codes if code != Codes.Good), None)
        return self._give(client, SET, tuple(names), tuple(values), ()) if bad is None else bad

    def operate(
        self,
        client: User,
        operation: str,
        names: tuple[str, ...] = (),
        values: tuple[float, ...] = (),
        texts: tuple[str, ...] = (),
    ) -> int:
        """Queue an operation of the line. Return a status code; the caller counts the request."""
        return self._give(client, operation, names, values, texts)

    def control(self, client: User, what: Control, value: float) -> int:
        """Control the run. Return a status code; the caller counts the request."""
        if not self.may_control(client):
            return int(Codes.BadUserAccessDenied)
        if what not in self._source.controls:
            return int(Codes.BadNotSupported)
        low, high = CONTROL_RANGES.get(what, (-math.inf, math.inf))
        if not low <= value <= high:
            return int(Codes.BadOutOfRange)
        refused = self._source.control(what, value, f"{_kind(client)} {_writer(client)}")
        return ReasonedCode(Codes.BadInvalidState, refused) if refused else int(Codes.GoodCompletesAsynchronously)

    def may_control(self, client: User) -> bool:
        """Return True if this client may control the run."""
        return _kind(client) in MAY_CONTROL

    def may(self, client: User, operation: str) -> bool:
        """Return True if the role of this client permits an operation."""
        return operation in MAY and _kind(client) in MAY[operation].writers

    def denied(self, client: User, operation: str) -> ReasonedCode:
        """Return the refusal of an operation that the role of this client does not permit."""
        kind = _kind(client)
        if kind is None:
            return ReasonedCode(Codes.BadUserAccessDenied, "this user only reads, expected a user with a role")
        reason = unauthorized(Input(OPCUA, _writer(client), kind, operation, (), ()), MAY)
        return ReasonedCode(Codes.BadUserAccessDenied, reason)

    def count(self, result: ua.CallMethodResult) -> None:
        """Count a call by its result."""
        good = result.StatusCode.value == Codes.GoodCompletesAsynchronously
        self.writes, self.refused = self.writes + good, self.refused + (not good)

    def _go_on(self, client: User, value: ua.WriteValue) -> int:
        """Set the target of a line in lockstep."""
        if _kind(client) not in MAY_GO_ON:
            return int(Codes.BadUserAccessDenied)
        if (code := _judge_form(value, ua.VariantType.Int64)) != Codes.Good:
            return code
        if "target" not in self._source.controls:
            return int(Codes.BadInvalidState)
        refused = self._source.control("target", value.Value.Value.Value, _writer(client))
        return int(Codes.BadOutOfRange if refused else Codes.GoodCompletesAsynchronously)

    def _set_mode(self, client: User, value: ua.WriteValue) -> int:
        """Set the control mode of a device by a write, for clients that can't call methods."""
        if not self.may(client, MODE):
            return self.denied(client, MODE)
        tag = self._modes[name_of(value.NodeId)]
        if (code := _judge_form(value, type_of(tag))) != Codes.Good:
            return code
        return self._give(client, MODE, (tag.device,), (float(value.Value.Value.Value),), ())

    def _judge(self, client: User, value: ua.WriteValue) -> tuple[int, float]:
        """Return the status code of a write, and its value as a number."""
        if not self.may(client, SET):
            return self.denied(client, SET), 0.0
        tag = self._commands.get(name_of(value.NodeId))
        if tag is None:
            return Codes.BadNotWritable, 0.0
        if (code := _judge_form(value, type_of(tag))) != Codes.Good:
            return code, 0.0
        number = float(value.Value.Value.Value)
        return self._judge_number(client, tag, number), number

    def _judge_number(self, client: User, tag: Tag, number: float) -> int:
        kind, writer = _kind(client), _writer(client)
        if kind is None:
            return Codes.BadUserAccessDenied
        request = Input(OPCUA, writer, kind, SET, (tag.name,), (number,))
        if refusal := refused_for_good(self._source, self._receipt, request):
            return ReasonedCode(CODES[refusal.cause], refusal.reason)
        if (code := self._run_code()) != Codes.Good:
            return code  # before the control mode, whose change would not help
        if reason := objection(self._source, tag, number, kind, writer):
            return ReasonedCode(Codes.BadUserAccessDenied, reason)
        return Codes.Good

    def _flush(self, client: User, together: dict[str, float], places: list[int], codes: list[int]) -> None:
        if together:
            code = self._give(client, SET, tuple(together), tuple(together.values()), ())
            for place in places:
                codes[place] = code
        together.clear()
        places.clear()

    def _give(
        self, client: User, operation: str, names: tuple[str, ...], values: tuple[float, ...], texts: tuple[str, ...]
    ) -> int:
        kind = _kind(client)
        if kind is None or not self.may(client, operation):
            return self.denied(client, operation)
        request = Input(OPCUA, _writer(client), kind, operation, names, values, texts)
        if refusal := refused_for_good(self._source, self._receipt, request):
            return ReasonedCode(CODES[refusal.cause], refusal.reason)
        if (code := self._run_code()) != Codes.Good:
            return code
        if refused := self._source.give(request):
            return ReasonedCode(Codes.BadTooManyOperations, refused)
        self.held.note(id(client), request)
        return Codes.GoodCompletesAsynchronously

    def _run_code(self) -> int:
        """Return Good if the line takes inputs at present."""
        snapshot = self._source.snapshot
        if snapshot.lost:
            return ReasonedCode(Codes.BadNoCommunication, snapshot.lost)
        if snapshot.run.state in TAKES_NO_INPUT:
            return ReasonedCode(Codes.BadInvalidState, f"the run is {snapshot.run.text}, and takes no input")
        return int(Codes.Good)

    def leave(self, client: User) -> None:
        """Release the buttons that a client holds, because its session has ended or has another user."""
        self.held.leave(id(client))


def _judge_form(value: ua.WriteValue, kind: ua.VariantType) -> int:
    """Return Good if a write has one complete value of type `kind`, otherwise the status code of the error."""
    if value.AttributeId != ua.AttributeIds.Value:
        return int(Codes.BadNotWritable)
    if value.IndexRange:
        return int(Codes.BadIndexRangeInvalid)
    status, variant = value.Value.StatusCode, value.Value.Value
    if status is not None and not status.is_good():
        return int(Codes.BadWriteNotSupported)
    if variant is None or variant.VariantType is not kind or isinstance(variant.Value, list):
        return int(Codes.BadTypeMismatch)
    return int(Codes.Good)


def _kind(client: User) -> WriterKind | None:
    return client.kind if isinstance(client, Client) else None


def _writer(client: User) -> str:
    return client.writer if isinstance(client, Client) else OPCUA

# SPDX-License-Identifier: Apache-2.0
"""Methods of a line, its alarms and its run: their nodes, and how calls are carried out."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from asyncua import ua
from asyncua.crypto.permission_rules import User

from conveyor_sim.line.alarms.alarm import CONFIRMED, WAITING
from conveyor_sim.line.commands.inputs import DISOWN, FORCE, INJECT, MODE, OWN, SET, UNFORCE
from conveyor_sim.line.run_state import RUN
from conveyor_sim.line.tag import COMMANDS, SIGNALS
from conveyor_sim.protocols.opcua.nodes import LINE, Nodes, name_of, node_id
from conveyor_sim.protocols.opcua.reasons import as_status
from conveyor_sim.protocols.opcua.requests import Codes, Requests
from conveyor_sim.protocols.tags.tag_provider import Control, TagProvider

ALARM_STATES = "alarm_states"
"""ID of the object that contains an object for each alarm."""

_LONGEST = 200
"""Largest number of characters in an argument."""
_MOST = 1000
"""Largest number of elements in an argument."""


class ConditionMethod(NamedTuple):
    """Method of conditions that refers to an event."""

    operation: str
    waiting: Collection[int]
    """States of alarms to which it applies."""
    otherwise: int
    """Status code in another state."""


_CONDITION_METHODS: Mapping[ua.NodeId, ConditionMethod] = {
    ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge): ConditionMethod(
        "acknowledge", WAITING, Codes.BadConditionBranchAlreadyAcked
    ),
    ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Confirm): ConditionMethod(
        "confirm", frozenset(CONFIRMED), Codes.BadConditionBranchAlreadyConfirmed
    ),
}
"""Methods by their IDs in the standard (OPC 10000-9, 5.7.3 and 5.7.4)."""

_TEXT, _NUMBER, _WHOLE = ua.VariantType.String, ua.VariantType.Double, ua.VariantType.UInt32


_NAME_AND_VALUE: Mapping[int, int] = {Codes.BadNodeIdUnknown: 0, Codes.BadOutOfRange: 1}
"""Place of the argument that caused a refusal, by status code: the name is first, the value second."""


class MethodParameter(NamedTuple):
    """Input argument of a method."""

    name: str
    kind: ua.VariantType
    what: str
    array: bool = False
    optional: bool = False
    """True if the argument may be empty."""

    @property
    def as_argument(self) -> ua.Argument:
        """Entry of the property InputArguments."""
        rank = ua.ValueRank.OneDimension if self.array else ua.ValueRank.Scalar
        return ua.Argument(self.name, ua.NodeId(self.kind.value), rank, [], ua.LocalizedText(self.what))


@dataclass(frozen=True)
class OpcUaMethod:
    """Description and effect of one method."""

    description: str
    parameters: tuple[MethodParameter, ...]
    operation: str = ""
    """Operation of the line; empty: the method controls the run."""
    control: Control | None = None


_ALARM = MethodParameter("alarm", _TEXT, "ID of the alarm.")
_ALARM_OR_ALL = MethodParameter("alarm", _TEXT, "ID of the alarm; empty: all.", optional=True)
_SIGNAL = MethodParameter("signal", _TEXT, "Name of the signal.")
_SECONDS = MethodParameter("seconds", _NUMBER, "Duration in simulated time; 0: until its condition ends.")

LINE_METHODS: dict[str, OpcUaMethod] = {
    "acknowledge": OpcUaMethod("Acknowledges an alarm, or all.", (_ALARM_OR_ALL,), "acknowledge"),
    "confirm": OpcUaMethod("Confirms an acknowledged alarm, or all that wait for it.", (_ALARM_OR_ALL,), "confirm"),
    "reset_alarm": OpcUaMethod("Clears a latched alarm, or all.", (_ALARM_OR_ALL,), "reset"),
    "shelve": OpcUaMethod("Shelves an alarm.", (_ALARM, _SECONDS), "shelve"),
    "unshelve": OpcUaMethod("Ends the shelving of an alarm, or of all.", (_ALARM_OR_ALL,), "unshelve"),
    "remove_from_service": OpcUaMethod("Takes an alarm out of service.", (_ALARM,), "remove_from_service"),
    "return_to_service": OpcUaMethod("Returns an alarm to service.", (_ALARM,), "return_to_service"),
    "set_mode": OpcUaMethod(
        "Sets the control mode of a device: 1 Automatic, 2 Maintenance, 3 Manual.",
        (MethodParameter("device", _TEXT, "Name of the device."), MethodParameter("mode", _WHOLE, "1, 2 or 3.")),
        MODE,
    ),
    "force": OpcUaMethod(
        "Forces a signal.",
        (_SIGNAL, MethodParameter("value", _NUMBER, "Value that controllers read.")),
        FORCE,
    ),
    "unforce": OpcUaMethod(
        "Ends the forcing of a signal, or of all.",
        (MethodParameter("signal", _TEXT, "Name of the signal; empty: all.", optional=True),),
        UNFORCE,
    ),
    "inject": OpcUaMethod(
        "Starts or ends a fault.",
        (MethodParameter("fault", _TEXT, "Name of the fault."), MethodParameter("value", _NUMBER, "0 ends the fault.")),
        INJECT,
    ),
    "reset_counters": OpcUaMethod(
        "Resets counters and times of a device, or of all.",
        (MethodParameter("device", _TEXT, "Name of the device; empty: all.", optional=True),),
        "reset_counters",
    ),
    "write": OpcUaMethod(
        "Sets commands together: all at one tick, or none.",
        (
            MethodParameter("commands", _TEXT, "Names of commands.", array=True),
            MethodParameter("values", _NUMBER, "One value per command.", array=True),
        ),
        SET,
    ),
    "own": OpcUaMethod(
        "Takes the line for this controller.",
        (
            MethodParameter(
                "released", _TEXT, "Patterns of devices that are released to other controllers.", array=True
            ),
        ),
        OWN,
    ),
    "disown": OpcUaMethod("Releases the line.", (), DISOWN),
}

ALARM_METHODS: dict[str, OpcUaMethod] = {
    "acknowledge": OpcUaMethod("Acknowledges this alarm; on the object of all alarms: all.", (), "acknowledge"),
    "confirm": OpcUaMethod("Confirms this alarm, if it is acknowledged and waits for it.", (), "confirm"),
    "reset": OpcUaMethod("Clears this alarm if it has latched.", (), "reset"),
    "unshelve": OpcUaMethod("Ends the shelving of this alarm.", (), "unshelve"),
}
"""Methods of the object of an alarm, for panels whose buttons have no arguments."""

RUN_METHODS: dict[str, OpcUaMethod] = {
    "pause": OpcUaMethod("Pauses the run.", (), control="pause"),
    "resume": OpcUaMethod("Resumes the run.", (), control="resume"),
    "step": OpcUaMethod(
        "Advances the run by ticks.", (MethodParameter("ticks", _WHOLE, "Number of ticks."),), control="step"
    ),
    "reset": OpcUaMethod("Restarts the run.", (), control="reset"),
    "seek": OpcUaMethod(
        "Moves the playback to a time.", (MethodParameter("time", _NUMBER, "Simulated time, s."),), control="seek"
    ),
    "speed": OpcUaMethod(
        "Sets the speed.",
        (MethodParameter("factor", _NUMBER, "Factor of real time; 0: as fast as possible."),),
        control="speed",
    ),
    "loop": OpcUaMethod(
        "Turns repetition of the playback on or off.",
        (MethodParameter("on", _WHOLE, "1: on; 0: off."),),
        control="loop",
    ),
}
"""Methods that control the run. Only those that the tag provider supports are added."""


def add_methods(nodes: Nodes, source: TagProvider) -> None:
    """Add the methods of the line and of its run."""
    for name, method in LINE_METHODS.items():
        _add(nodes, LINE, name, method)
    for name, method in RUN_METHODS.items():
        if method.control in source.controls:
            _add(nodes, RUN, name, method)


def add_alarm_methods(nodes: Nodes) -> None:
    """Add the methods that all alarms share to the object of all alarms."""
    for name, method in ALARM_METHODS.items():
        _add(nodes, ALARM_STATES, name, method)


def _add(nodes: Nodes, owner: str, name: str, method: OpcUaMethod) -> None:
    arguments = [parameter.as_argument for parameter in method.parameters]
    nodes.method(f"{owner}/{name}", node_id(owner), method.description, arguments)


class Methods:
    """Calls of methods by clients."""

    def __init__(self, source: TagProvider, requests: Requests, is_last_event: Callable[[str, bytes], bool]) -> None:
        """Prepare the calls. is_last_event: returns True if an ID is that of the last event of an alarm."""
        self._source, self._requests, self._is_last_event = source, requests, is_last_event
        tags = source.info.tags
        self._tags = {tag.name: tag for tag in tags}
        self._devices = {tag.device for tag in tags}
        self._known: dict[str, Callable[[str], bool]] = {
            "alarm": lambda name: self.knows_alarm(name),
            "device": lambda name: name in self._devices,
            "signal": lambda name: self._is(name, SIGNALS),
            "fault": lambda name: self._is(name, ("fault",)),
            "commands": lambda name: self._is(name, COMMANDS),
        }

    def knows_alarm(self, id: str) -> bool:
        """Return True if there is such an alarm."""
        alarms = self._source.snapshot.alarms
        return alarms is not None and id in alarms.id

    def call(self, client: User, request: ua.CallMethodRequest) -> ua.CallMethodResult | None:
        """Return the result of a call; None for a method that is not of this class."""
        if (condition_method := _CONDITION_METHODS.get(request.MethodId)) is not None:
            return self._answer_event(client, request, condition_method)
        owner, _, name = name_of(request.MethodId).rpartition("/")
        target = name_of(request.ObjectId)
        table = {LINE: LINE_METHODS, RUN: RUN_METHODS, ALARM_STATES: ALARM_METHODS}.get(owner, {})
        method = table.get(name)
        if method is None:
            return None
        alarm = target.removeprefix(f"{ALARM_STATES}/")
        if target != owner and (owner != ALARM_STATES or alarm == target or not self.knows_alarm(alarm)):
            return _result(Codes.BadMethodInvalid)
        inputs = [] if request.InputArguments is None else list(request.InputArguments)
        if method.operation and not self._requests.may(client, method.operation):
            return _result(self._requests.denied(client, method.operation))
        if not method.operation and not self._requests.may_control(client):
            return _result(Codes.BadUserAccessDenied)
        if len(inputs) != len(method.parameters):
            few = len(inputs) < len(method.parameters)
            return _result(Codes.BadArgumentsMissing if few else Codes.BadTooManyArguments)
        codes = [self._judge(parameter, value) for parameter, value in zip(method.parameters, inputs, strict=True)]
        if any(code != Codes.Good for code in codes):
            return _result(Codes.BadInvalidArgument, codes)
        arguments = [value.Value for value in inputs]
        if method.control is not None:
            value = float(arguments[0]) if arguments else 0.0
            code = self._requests.control(client, method.control, value)
            return _of_arguments(code, {Codes.BadOutOfRange: 0}, inputs)
        if owner == ALARM_STATES:
            return _result(self._requests.operate(client, method.operation, () if target == owner else (alarm,)))
        return self._operate(client, method, arguments)

    def _answer_event(
        self, client: User, request: ua.CallMethodRequest, method: ConditionMethod
    ) -> ua.CallMethodResult:
        """Call Acknowledge or Confirm of a condition: EventId, Comment. The comment is not stored."""
        alarm = name_of(request.ObjectId).removeprefix(f"{ALARM_STATES}/")
        if not self.knows_alarm(alarm):
            return _result(Codes.BadNodeIdInvalid)
        if not self._requests.may(client, method.operation):
            return _result(self._requests.denied(client, method.operation))
        inputs = request.InputArguments or []
        if not inputs or not isinstance(inputs[0].Value, bytes) or not self._is_last_event(alarm, inputs[0].Value):
            return _result(Codes.BadEventIdUnknown)
        alarms = self._source.snapshot.alarms
        if alarms is None or alarms.state[list(alarms.id).index(alarm)] not in method.waiting:
            return _result(method.otherwise)
        return _result(self._requests.operate(client, method.operation, (alarm,)))

    def _operate(self, client: User, method: OpcUaMethod, arguments: Sequence[Any]) -> ua.CallMethodResult:
        if method.operation == SET:
            names, values = arguments
            if not names or len(names) != len(values) or len(set(names)) != len(names):
                return _result(Codes.BadInvalidArgument)
            return _result(self._requests.write_together(client, names, values))
        if method.operation == OWN:
            code = self._requests.operate(client, OWN, texts=tuple(arguments[0] or ()))
            return _of_arguments(code, _NAME_AND_VALUE, arguments)
        names = (arguments[0],) if arguments and arguments[0] else ()
        values = tuple(float(value) for value in arguments[1:])
        code = self._requests.operate(client, method.operation, names, values)
        return _of_arguments(code, _NAME_AND_VALUE, arguments)

    def _judge(self, parameter: MethodParameter, argument: ua.Variant) -> int:
        values = argument.Value if parameter.array else [argument.Value]
        if argument.VariantType is not parameter.kind or isinstance(argument.Value, list) != parameter.array:
            # An array without elements may come as a null.
            return Codes.Good if parameter.array and argument.Value is None else Codes.BadTypeMismatch
        if len(values) > _MOST or any(isinstance(value, str) and len(value) > _LONGEST for value in values):
            return Codes.BadOutOfRange
        if any(value is None and not parameter.optional for value in values):
            return Codes.BadOutOfRange
        if any(isinstance(value, float) and not math.isfinite(value) for value in values):
            return Codes.BadOutOfRange
        known = self._known.get(parameter.name)
        if known is not None and not all(known(value) or (parameter.optional and not value) for value in values):
            return Codes.BadNodeIdUnknown
        return Codes.Good

    def _is(self, name: str, roles: Sequence[str]) -> bool:
        return name in self._tags and self._tags[name].role in roles


def _of_arguments(code: int, places: Mapping[int, int], arguments: Sequence[Any]) -> ua.CallMethodResult:
    """Return the result of a call, with the code at the argument that caused it (OPC 10000-4, 5.11.2)."""
    if code not in places:
        return _result(code)
    codes = [code if place == places[code] else Codes.Good for place in range(len(arguments))]
    return _result(Codes.BadInvalidArgument, codes)


def _result(code: int, arguments: Sequence[int] = ()) -> ua.CallMethodResult:
    return ua.CallMethodResult(as_status(code), [ua.StatusCode(each) for each in arguments], [], [])

"""Methods of a line, its alarms and its run: which there are, and what a call becomes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from asyncua import ua
from asyncua.crypto.permission_rules import User

from conveyor_sim.line.alarms.alarm import WAITING
from conveyor_sim.line.commands.inputs import DISOWN, FORCE, INJECT, MODE, OWN, SET, UNFORCE
from conveyor_sim.line.run_state import RUN
from conveyor_sim.line.tag import COMMANDS, SIGNALS
from conveyor_sim.protocols.opcua.nodes import LINE, Nodes, name_of, node_id
from conveyor_sim.protocols.opcua.requests import Codes, Requests
from conveyor_sim.protocols.tags.tag_provider import Control, TagProvider

ALARM_STATES = "alarm_states"
"""Id of the object that holds an object for each alarm."""

_LONGEST = 200
"""Characters of an argument."""
_MOST = 1000
"""Elements of one."""

_ACKNOWLEDGE = ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge)

_TEXT, _NUMBER, _WHOLE = ua.VariantType.String, ua.VariantType.Double, ua.VariantType.UInt32


_NAME_AND_VALUE: Mapping[int, int] = {Codes.BadNodeIdUnknown: 0, Codes.BadOutOfRange: 1}
"""Place of the argument that caused a refusal, by status code: the name is first, the value second."""


class MethodParameter(NamedTuple):
    """What a method is given."""

    name: str
    kind: ua.VariantType
    what: str
    array: bool = False
    optional: bool = False
    """Whether it may be empty."""

    @property
    def as_argument(self) -> ua.Argument:
        """As InputArguments has it."""
        rank = ua.ValueRank.OneDimension if self.array else ua.ValueRank.Scalar
        return ua.Argument(self.name, ua.NodeId(self.kind.value), rank, [], ua.LocalizedText(self.what))


@dataclass(frozen=True)
class OpcUaMethod:
    """One of them."""

    description: str
    parameters: tuple[MethodParameter, ...]
    operation: str = ""
    """What it has the line do; empty: it asks something of the run."""
    control: Control | None = None


_ALARM = MethodParameter("alarm", _TEXT, "Id of the alarm.")
_ALARM_OR_ALL = MethodParameter("alarm", _TEXT, "Id of the alarm; empty: all that this can be done to.", optional=True)
_SIGNAL = MethodParameter("signal", _TEXT, "Name of the signal.")
_SECONDS = MethodParameter("seconds", _NUMBER, "For how long, simulated time; 0: until its condition ends next.")

LINE_METHODS: dict[str, OpcUaMethod] = {
    "acknowledge": OpcUaMethod("Acknowledges an alarm, or all.", (_ALARM_OR_ALL,), "acknowledge"),
    "reset_alarm": OpcUaMethod("Clears a latched alarm, or all.", (_ALARM_OR_ALL,), "reset"),
    "shelve": OpcUaMethod("Shelves an alarm.", (_ALARM, _SECONDS), "shelve"),
    "unshelve": OpcUaMethod("Ends that, for one alarm or all.", (_ALARM_OR_ALL,), "unshelve"),
    "remove_from_service": OpcUaMethod("Takes an alarm out of service.", (_ALARM,), "remove_from_service"),
    "return_to_service": OpcUaMethod("Ends that.", (_ALARM,), "return_to_service"),
    "set_mode": OpcUaMethod(
        "Puts a device into a mode: 1 Automatic, 2 Maintenance, 3 Manual.",
        (MethodParameter("device", _TEXT, "Name of the device."), MethodParameter("mode", _WHOLE, "1, 2 or 3.")),
        MODE,
    ),
    "force": OpcUaMethod(
        "Has controllers read another value of a signal.",
        (_SIGNAL, MethodParameter("value", _NUMBER, "What they read.")),
        FORCE,
    ),
    "unforce": OpcUaMethod(
        "Ends that.", (MethodParameter("signal", _TEXT, "Name of the signal; empty: all.", optional=True),), UNFORCE
    ),
    "inject": OpcUaMethod(
        "Has a fault begin, or end.",
        (MethodParameter("fault", _TEXT, "Name of the fault."), MethodParameter("value", _NUMBER, "0: it ends.")),
        INJECT,
    ),
    "reset_counters": OpcUaMethod(
        "Counters and times of a device, or of all, begin anew.",
        (MethodParameter("device", _TEXT, "Name of the device; empty: all.", optional=True),),
        "reset_counters",
    ),
    "write": OpcUaMethod(
        "Sets commands together: all at one tick, or none.",
        (
            MethodParameter("commands", _TEXT, "Names.", array=True),
            MethodParameter("values", _NUMBER, "One for each.", array=True),
        ),
        SET,
    ),
    "own": OpcUaMethod(
        "Takes the line for this controller.",
        (MethodParameter("released", _TEXT, "Patterns of devices that it leaves to others.", array=True),),
        OWN,
    ),
    "disown": OpcUaMethod("Gives it up.", (), DISOWN),
}

ALARM_METHODS: dict[str, OpcUaMethod] = {
    "acknowledge": OpcUaMethod("Acknowledges this alarm; of the object of all alarms: all.", (), "acknowledge"),
    "reset": OpcUaMethod("Clears it, if it has latched.", (), "reset"),
    "unshelve": OpcUaMethod("Shelves it no more.", (), "unshelve"),
}
"""Of the object of an alarm, for panels whose buttons give no arguments."""

RUN_METHODS: dict[str, OpcUaMethod] = {
    "pause": OpcUaMethod("Time stands.", (), control="pause"),
    "resume": OpcUaMethod("Time goes on.", (), control="resume"),
    "step": OpcUaMethod("Lets ticks pass.", (MethodParameter("ticks", _WHOLE, "How many."),), control="step"),
    "reset": OpcUaMethod("Begins anew.", (), control="reset"),
    "seek": OpcUaMethod("Goes to a time.", (MethodParameter("time", _NUMBER, "Simulated time, s."),), control="seek"),
    "speed": OpcUaMethod(
        "How fast time passes.", (MethodParameter("factor", _NUMBER, "Times real time."),), control="speed"
    ),
    "loop": OpcUaMethod("Begins anew at the end, or not.", (MethodParameter("on", _WHOLE, "1 or 0."),), control="loop"),
}
"""Those that the source can do are there."""


def add_methods(nodes: Nodes, source: TagProvider) -> None:
    """Add those of the line and of its run."""
    for name, method in LINE_METHODS.items():
        _add(nodes, LINE, name, method)
    for name, method in RUN_METHODS.items():
        if method.control in source.controls:
            _add(nodes, RUN, name, method)


def add_alarm_methods(nodes: Nodes) -> None:
    """Add those that all alarms have, to the object of all of them."""
    for name, method in ALARM_METHODS.items():
        _add(nodes, ALARM_STATES, name, method)


def _add(nodes: Nodes, owner: str, name: str, method: OpcUaMethod) -> None:
    arguments = [parameter.as_argument for parameter in method.parameters]
    nodes.method(f"{owner}/{name}", node_id(owner), method.description, arguments)


class Methods:
    """Calls of them, by clients."""

    def __init__(self, source: TagProvider, requests: Requests, is_last_event: Callable[[str, bytes], bool]) -> None:
        """is_last_event: whether an alarm's last event had that id."""
        self._source, self._requests, self._is_last_event = source, requests, is_last_event
        tags = source.about.tags
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
        """Whether there is such an alarm."""
        alarms = self._source.shown.alarms
        return alarms is not None and id in alarms.id

    def call(self, client: User, request: ua.CallMethodRequest) -> ua.CallMethodResult | None:
        """Return the result of a call and count it; None for a method that is not of this class."""
        result = self._call(client, request)
        return None if result is None else self._requests.counted(result)

    def _call(self, client: User, request: ua.CallMethodRequest) -> ua.CallMethodResult | None:
        if request.MethodId == _ACKNOWLEDGE:
            return self._acknowledge_event(client, request)
        owner, _, name = name_of(request.MethodId).rpartition("/")
        target = name_of(request.ObjectId)
        table = {LINE: LINE_METHODS, RUN: RUN_METHODS, ALARM_STATES: ALARM_METHODS}.get(owner, {})
        method = table.get(name)
        if method is None:
            return None
        alarm = target.removeprefix(f"{ALARM_STATES}/")
        if target != owner and (owner != ALARM_STATES or alarm == target or not self.knows_alarm(alarm)):
            return _result(Codes.BadMethodInvalid)
        given = [] if request.InputArguments is None else list(request.InputArguments)
        may = self._requests.may(client, method.operation) if method.operation else self._requests.may_control(client)
        if not may:
            return _result(Codes.BadUserAccessDenied)
        if len(given) != len(method.parameters):
            few = len(given) < len(method.parameters)
            return _result(Codes.BadArgumentsMissing if few else Codes.BadTooManyArguments)
        codes = [self._judge(parameter, value) for parameter, value in zip(method.parameters, given, strict=True)]
        if any(code != Codes.Good for code in codes):
            return _result(Codes.BadInvalidArgument, codes)
        arguments = [value.Value for value in given]
        if method.control is not None:
            value = float(arguments[0]) if arguments else 0.0
            return _of_arguments(self._requests.control(client, method.control, value), {Codes.BadOutOfRange: 0}, given)
        if owner == ALARM_STATES:
            return _result(self._requests.operate(client, method.operation, () if target == owner else (alarm,)))
        return self._operate(client, method, arguments)

    def _acknowledge_event(self, client: User, request: ua.CallMethodRequest) -> ua.CallMethodResult:
        """The method of conditions: EventId, Comment (OPC 10000-9, 5.7.3); the comment is not kept."""
        alarm = name_of(request.ObjectId).removeprefix(f"{ALARM_STATES}/")
        if not self.knows_alarm(alarm):
            return _result(Codes.BadNodeIdInvalid)
        if not self._requests.may(client, "acknowledge"):
            return _result(Codes.BadUserAccessDenied)
        given = request.InputArguments or []
        if not given or not isinstance(given[0].Value, bytes) or not self._is_last_event(alarm, given[0].Value):
            return _result(Codes.BadEventIdUnknown)
        alarms = self._source.shown.alarms
        if alarms is None or alarms.state[list(alarms.id).index(alarm)] not in WAITING:
            return _result(Codes.BadConditionBranchAlreadyAcked)
        return _result(self._requests.operate(client, "acknowledge", (alarm,)))

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

    def _judge(self, parameter: MethodParameter, given: ua.Variant) -> int:
        values = given.Value if parameter.array else [given.Value]
        if given.VariantType is not parameter.kind or isinstance(given.Value, list) != parameter.array:
            # An array without elements may come as a null.
            return Codes.Good if parameter.array and given.Value is None else Codes.BadTypeMismatch
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
    return ua.CallMethodResult(ua.StatusCode(code), [ua.StatusCode(each) for each in arguments], [], [])

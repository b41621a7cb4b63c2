# SPDX-License-Identifier: Apache-2.0
"""`PackMl`: each machine as a PackML object by OPC 30050, with the types of the OPC Foundation's own NodeSet.

nodesets/Opc.Ua.PackML.NodeSet2.xml is version 1.01 of github.com/OPCFoundation/UA-Nodeset, under the OPC Foundation MIT
License 1.00, which stands in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from asyncua import Server, ua
from asyncua.common.instantiate_util import instantiate
from asyncua.crypto.permission_rules import User

from conveyor_sim.line.commands.inputs import MODE, SET
from conveyor_sim.line.machines.packml import Command, PackMLState, objection
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.opcua.nodes import INDEX, Nodes, name_of, node_id
from conveyor_sim.protocols.opcua.packml_admin import A_MINUTE, Admin
from conveyor_sim.protocols.opcua.packml_admin import NAME as ADMIN
from conveyor_sim.protocols.opcua.packml_times import NewsReader
from conveyor_sim.protocols.opcua.reasons import ReasonedCode, as_status
from conveyor_sim.protocols.opcua.requests import Codes, Requests
from conveyor_sim.protocols.opcua.values import status_of
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider, TickClock
from conveyor_sim.support.rounded_limit import at_limit, single

NODESET = Path(__file__).parent / "nodesets" / "Opc.Ua.PackML.NodeSet2.xml"
NAMESPACE = "http://opcfoundation.org/UA/PackML/"

NAME = "PackML"
"""Name of the object below a machine."""

_TYPE = 6
"""PackMLBaseObjectType."""

_OBJECTS = 72
"""PackMLObjects, the folder below Objects that contains all PackML objects (OPC 30050, 6.2)."""

_MODES = 11
"""ProductionMaintenanceModeEnum, whose numbers the control modes use."""

_METHODS: Mapping[int, Command] = {
    361: Command.RESET,
    376: Command.RESET,
    369: Command.START,
    375: Command.STOP,
    366: Command.HOLD,
    368: Command.UNHOLD,
    367: Command.SUSPEND,
    372: Command.UNSUSPEND,
    364: Command.ABORT,
    363: Command.CLEAR,
    365: Command.COMPLETE,
}
"""Commands by the IDs of their methods in the NodeSet."""

_BASE, _MACHINE, _EXECUTE = (
    "BaseStateMachine",
    "BaseStateMachine.MachineState",
    "BaseStateMachine.MachineState.ExecuteState",
)

_OF: Mapping[str, tuple[int, ...]] = {
    _BASE: (363, 364),
    _MACHINE: (375, 376),
    _EXECUTE: (361, 365, 366, 367, 368, 369, 372),
}
"""Methods of each of the three nested state machines."""

_TYPES: Mapping[str, int] = {_BASE: 3, _MACHINE: 2, _EXECUTE: 1}
"""Types of the state machines."""

_PARTS: Mapping[str, tuple[int, ...]] = {
    "AvailableStates": (ua.ObjectIds.StateType, ua.ObjectIds.InitialStateType),
    "AvailableTransitions": (ua.ObjectIds.TransitionType,),
}
"""Variables of a state machine that list parts of its type, with the types of these parts."""

_CLEARED, _RUNNING = ("Cleared", 71), ("Running", 75)

_STATES: Mapping[str, Mapping[PackMLState, tuple[str, int]]] = {
    _BASE: {PackMLState.ABORTING: ("Aborting", 61), PackMLState.ABORTED: ("Aborted", 62)},
    _MACHINE: {
        PackMLState.STOPPED: ("Stopped", 53),
        PackMLState.STOPPING: ("Stopping", 54),
        PackMLState.CLEARING: ("Clearing", 55),
    },
    _EXECUTE: {
        PackMLState.RESETTING: ("Resetting", 27),
        PackMLState.IDLE: ("Idle", 28),
        PackMLState.STARTING: ("Starting", 29),
        PackMLState.SUSPENDING: ("Suspending", 30),
        PackMLState.SUSPENDED: ("Suspended", 31),
        PackMLState.UNSUSPENDING: ("Unsuspending", 32),
        PackMLState.HOLDING: ("Holding", 33),
        PackMLState.HELD: ("Held", 34),
        PackMLState.UNHOLDING: ("Unholding", 35),
        PackMLState.EXECUTE: ("Execute", 36),
        PackMLState.COMPLETING: ("Completing", 37),
        PackMLState.COMPLETE: ("Complete", 38),
    },
}
"""Names and IDs of states by state machine."""

_NONE = (ua.LocalizedText(None), ua.NodeId())
"""State of a state machine that is not active, and its id."""


class PackMl:
    """PackML objects of one tag provider."""

    def __init__(self, source: TagProvider, requests: Requests, clock: TickClock) -> None:
        self._source, self._requests, self._clock = source, requests, clock
        self._tags: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags}
        self._machines = [tag.device for tag in source.info.tags if tag.name == f"{tag.device}/cntrl_cmd"]
        self._admins = {machine: Admin(machine, self._tags, source.info, clock) for machine in self._machines}
        self._news = NewsReader(source)
        self._nodes: Nodes | None = None
        self._index = 0
        self._status = int(Codes.Good)
        self._written: dict[tuple[str, str], Any] = {}

    async def add(self, server: Server, nodes: Nodes) -> None:
        """Add the types, and an object for each machine, if there are machines."""
        if not self._machines:
            return
        self._nodes = nodes
        await server.import_xml(NODESET)
        self._index = await server.get_namespace_index(NAMESPACE)
        kind = server.get_node(ua.NodeId(_TYPE, self._index))
        parts = await self._parts(server)
        modes, data_type = ua.NodeId(_MODES, self._index), ua.AttributeIds.DataType
        for machine in self._machines:
            root = f"{machine}/{NAME}"
            parent, name = server.get_node(node_id(machine)), ua.QualifiedName(NAME, INDEX)
            await instantiate(
                parent, kind, node_id(root), bname=name, dname=_shown_name(machine), instantiate_optional=False
            )
            folder = ua.NodeId(_OBJECTS, self._index)
            nodes.refer(folder, node_id(root), ua.ObjectIds.Organizes, ua.NodeClass.Object)
            for state_machine, methods in _OF.items():
                for method in methods:
                    target = ua.NodeId(method, self._index)
                    owner = node_id(f"{root}.{state_machine}")
                    nodes.refer(owner, target, ua.ObjectIds.HasComponent, ua.NodeClass.Method)
            await self._admins[machine].add(server, root, self._index)
            rate = self._tags[f"{machine}/rate"]
            span = ua.Variant(ua.Range(rate.low * A_MINUTE, rate.high * A_MINUTE))
            now = self._clock.simulated(0)
            for name, result in parts.items():
                await nodes.write(f"{root}.{name}", result, now)
            await nodes.write(f"{root}.Status.UnitSupportedModes", ua.Variant(modes), now)
            mode = server.get_node(node_id(f"{root}.Status.UnitModeCurrent"))
            await mode.write_attribute(data_type, ua.DataValue(ua.Variant(modes)))
            for speed in ("MachSpeed", "CurMachSpeed"):
                await nodes.write(f"{root}.Status.{speed}.EURange", span, now)

    async def _parts(self, server: Server) -> dict[str, ua.Variant]:
        """Return the IDs of the states and transitions of each state machine, by the variables that list them."""
        result: dict[str, ua.Variant] = {}
        for state_machine, kind in _TYPES.items():
            parts = await server.get_node(ua.NodeId(kind, self._index)).get_children_descriptions()
            for name, kinds in _PARTS.items():
                ids = [part.NodeId for part in parts if part.TypeDefinition in [ua.NodeId(each) for each in kinds]]
                result[f"{state_machine}.{name}"] = ua.Variant(ids, ua.VariantType.NodeId, is_array=True)
        return result

    async def follow(self, snapshot: LineSnapshot, heard: datetime, back: bool) -> None:
        """Write the variables that have changed."""
        if self._nodes is None:
            return
        status, stamp = status_of(snapshot), self._clock.stamp(snapshot.tick, heard)
        if status != self._status or back:
            self._status = status
            self._written.clear()
        news = self._news.read(snapshot, back)
        for machine in self._machines:
            admin = self._admins[machine].values(snapshot, heard, back, news)
            of_admin = {f"{ADMIN}.{name}": value for name, value in admin.items()}
            for name, value in {**self._values(machine, snapshot.values), **of_admin}.items():
                if self._written.get((machine, name)) != value:
                    self._written[machine, name] = value
                    inactive = value.Value in _NONE and status == Codes.Good
                    code = Codes.BadStateNotActive if inactive else status
                    await self._nodes.write(f"{machine}/{NAME}.{name}", value, stamp, code)

    def call(self, client: User, request: ua.CallMethodRequest) -> ua.CallMethodResult | None:
        """Return the result of a call of a machine's method; None for any other method."""
        machine, _, _ = name_of(request.ObjectId).partition(f"/{NAME}")
        if machine not in self._machines:
            return None
        arguments = [each.Value for each in request.InputArguments or []]
        method = int(request.MethodId.Identifier) if request.MethodId.NamespaceIndex == self._index else 0
        name = name_of(request.MethodId).rpartition(".")[2] or {362: "SetUnitMode", 400: "SetMachSpeed"}.get(method, "")
        if method in _METHODS:
            return _result(self._command(client, machine, _METHODS[method]))
        if name not in ("SetUnitMode", "SetMachSpeed"):
            return None
        operation = SET if name == "SetMachSpeed" else MODE
        if not self._requests.may(client, operation):
            return _result(self._requests.denied(client, operation))
        if len(arguments) != 1 or not isinstance(arguments[0], int | float) or isinstance(arguments[0], bool):
            return _result(Codes.BadInvalidArgument)
        value = float(arguments[0])
        if name == "SetMachSpeed":
            is_single = request.InputArguments[0].VariantType is ua.VariantType.Float
            rate = _a_second(value, self._tags[f"{machine}/rate"], is_single)
            return _result(self._requests.write_together(client, [f"{machine}/rate"], [rate]))
        if isinstance(arguments[0], float) or value not in self._tags[f"{machine}/mode"].texts:
            return _result(Codes.BadInvalidArgument)
        return _result(self._requests.operate(client, MODE, (machine,), (value,)))

    def _command(self, client: User, machine: str, command: Command) -> int:
        name, snapshot = f"{machine}/cntrl_cmd", self._source.snapshot.values
        if not self._requests.may(client, SET):
            return self._requests.denied(client, SET)
        if wrong := objection(command, int(snapshot[f"{machine}/state"])):
            return ReasonedCode(Codes.BadInvalidState, f"{machine}: {wrong}")
        if snapshot.get(name) == command:  # a command acts when its value changes
            code = self._requests.write_together(client, [name], [0.0])
            if code != Codes.GoodCompletesAsynchronously:
                return code
        return self._requests.write_together(client, [name], [float(command)])

    def _values(self, machine: str, values: Mapping[str, float]) -> dict[str, ua.Variant]:
        """Return the values of the variables of a machine, by their names below its object."""

        def flag(name: str) -> ua.Variant:
            return ua.Variant(values.get(f"{machine}/{name}", 0.0) != 0.0, ua.VariantType.Boolean)

        def speed(name: str) -> ua.Variant:
            return ua.Variant(values[f"{machine}/{name}"] * A_MINUTE, ua.VariantType.Float)

        result = {
            "Status.UnitModeCurrent": ua.Variant(int(values[f"{machine}/mode"]), ua.VariantType.Int32),
            "Status.MachSpeed": speed("rate"),
            "Status.CurMachSpeed": speed("cur_rate"),
            "Status.EquipmentBlocked": flag("blocked"),
            "Status.EquipmentStarved": flag("starved"),
        }
        number = int(values[f"{machine}/state"])
        for state_machine, (text, state) in self._current(number).items():
            result[f"{state_machine}.CurrentState"] = ua.Variant(ua.LocalizedText(text))
            result[f"{state_machine}.CurrentState.Id"] = ua.Variant(
                ua.NodeId(state, self._index) if state else ua.NodeId()
            )
        return result

    def _current(self, number: int) -> dict[str, tuple[str | None, int]]:
        """Return the present state of each state machine; without a text: it is not active."""
        states: dict[str, tuple[str | None, int]] = dict.fromkeys(_STATES, (None, 0))
        outer = {_BASE: {}, _MACHINE: {_BASE: _CLEARED}, _EXECUTE: {_BASE: _CLEARED, _MACHINE: _RUNNING}}
        for state_machine, known in _STATES.items():
            if number in known:
                states |= {**outer[state_machine], state_machine: known[PackMLState(number)]}
        return states


def _shown_name(machine: str) -> ua.LocalizedText:
    """Return the display name of a PackML object. In PackMLObjects, all have the browse name PackML."""
    return ua.LocalizedText(f"{NAME} of {machine.rpartition('/')[2]}")


def _a_second(speed: float, rate: Tag, is_single: bool) -> float:
    """Return a speed (packages per minute) as a rate (1/s).

    A limit that the sender's type has rounded is accepted as the limit.
    """

    def there_and_back(limit: float) -> float:
        a_minute = limit * A_MINUTE
        return (single(a_minute) if is_single else a_minute) / A_MINUTE

    return at_limit(speed / A_MINUTE, rate.low, rate.high, there_and_back)


def _result(code: int) -> ua.CallMethodResult:
    return ua.CallMethodResult(as_status(code), [], [], [])

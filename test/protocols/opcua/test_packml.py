# SPDX-License-Identifier: Apache-2.0
"""Machines as PackML objects: the types of OPC 30050, their values, and the commands as methods."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from asyncua import ua

from conveyor_sim.line.alarms.alarm import AlarmState
from conveyor_sim.line.machines.packml import Command, PackMLState
from conveyor_sim.line.tag import number
from conveyor_sim.protocols.opcua.packml import NAMESPACE, NODESET, _a_second
from test.protocols.opcua.conftest import refused

if TYPE_CHECKING:
    from asyncua.sync import Client, SyncNode

    from test.protocols.opcua.conftest import Line

Codes = ua.StatusCodes
OBJECT = "machines/filler/PackML"


def child(client: Client, *names: str) -> SyncNode:
    """Return a node by the browse names of the standard."""
    index = client.get_namespace_index(NAMESPACE)
    filler = client.get_node(f"ns=2;s={OBJECT}")
    standard = ("CurrentState", "Id", "EURange", "AvailableStates", "AvailableTransitions")
    return filler.get_child([f"{0 if name in standard else index}:{name}" for name in names])


def states(line: Line) -> list[str | None]:
    """Return the states of the three nested state machines; None: it is not active."""
    found: list[str | None] = []
    path: list[str] = []
    for name in ("BaseStateMachine", "MachineState", "ExecuteState"):
        path.append(name)
        value = child(line.open[0], *path, "CurrentState").read_data_value(raise_on_bad_status=False)
        assert (value.Value.Value is None) == (value.StatusCode.value == Codes.BadStateNotActive)
        found.append(value.Value.Value and value.Value.Value.Text)
    return found


def test_a_machine_is_an_object_of_the_standards_type(line: Line) -> None:
    client = line.client()
    line.advance(3)
    kind = client.get_node(client.get_node(f"ns=2;s={OBJECT}").read_type_definition())
    assert kind.read_browse_name().Name == "PackMLBaseObjectType"
    assert kind.nodeid.NamespaceIndex == client.get_namespace_index(NAMESPACE) > 2
    shown = line.source.snapshot.values
    assert child(client, "Status", "CurMachSpeed").read_value() == pytest.approx(shown["machines/filler/cur_rate"] * 60)
    assert child(client, "Status", "MachSpeed").read_value() == pytest.approx(shown["machines/filler/rate"] * 60)
    assert child(client, "Status", "MachSpeed", "EURange").read_value().High == pytest.approx(96.0)  # 1.6 a second
    mode = child(client, "Status", "UnitModeCurrent")
    assert mode.read_value() == 1
    assert mode.read_data_type() == child(client, "Status", "UnitSupportedModes").read_value()
    assert client.get_node(mode.read_data_type()).read_browse_name().Name == "ProductionMaintenanceModeEnum"
    path = ("BaseStateMachine", "MachineState", "ExecuteState")
    transitions: list[ua.NodeId] = []
    for depth, count in enumerate((3, 4, 12), start=1):
        listed = child(client, *path[:depth], "AvailableStates").read_value()
        names = {client.get_node(each).read_browse_name().Name for each in listed}
        assert len(names) == count and states(line)[depth - 1] in names
        transitions += child(client, *path[:depth], "AvailableTransitions").read_value()
    assert len(set(transitions)) == len(transitions) == NODESET.read_text().count('"HasTypeDefinition">i=2310<')
    assert child(client, "Status", "EquipmentBlocked").read_value() is False
    assert states(line) == ["Cleared", "Running", "Execute"]
    id = child(client, "BaseStateMachine", "CurrentState", "Id").read_value()
    assert client.get_node(id).read_browse_name().Name == "Cleared"


def call(client: Client, method: str, *arguments: Any) -> None:
    """Call a method where the standard has it."""
    path = ("BaseStateMachine", "MachineState", "ExecuteState")
    depth = {"Clear": 1, "Abort": 1, "Stop": 2}.get(method, 3)
    owner = child(client, *path[:depth])
    owner.call_method(f"{client.get_namespace_index(NAMESPACE)}:{method}", *arguments)


def test_commands_are_methods(line: Line) -> None:
    client = line.client("controller")
    line.advance(3)
    for method, state, expected in (
        ("Stop", PackMLState.STOPPED, ["Cleared", "Stopped", None]),
        ("Reset", PackMLState.IDLE, ["Cleared", "Running", "Idle"]),
        ("Start", PackMLState.EXECUTE, ["Cleared", "Running", "Execute"]),
        ("Abort", PackMLState.ABORTED, ["Aborted", None, None]),
        ("Clear", PackMLState.STOPPED, ["Cleared", "Stopped", None]),
    ):
        call(client, method)
        for _ in range(5):
            line.advance()
        assert (line.read("machines/filler/state"), states(line)) == (state, expected), method
    with refused(Codes.BadInvalidState):
        call(client, "Hold")  # it is stopped
    assert [row[3] for row in line.outcomes()] == [
        (float(command),) for command in (Command.STOP, Command.RESET, Command.START, Command.ABORT, Command.CLEAR)
    ]


def admin(line: Line, name: str) -> Any:
    return child(line.open[0], "Admin", name).read_value()


def test_admin_has_counts_the_stop_reason_and_alarms(line: Line) -> None:
    line.client()
    line.advance(300)
    (count,) = admin(line, "ProdProcessedCount")
    produced = line.source.snapshot.values["machines/filler/produced"]
    assert (count.Count, count.AccCount, count.Name, count.Unit.UnitId) == (produced, produced, "bottles", 4404786)
    assert produced > 0 and admin(line, "MachDesignSpeed") == pytest.approx(96.0)
    assert (admin(line, "AlarmExtent"), admin(line, "Alarm")) == (0, [])
    assert admin(line, "StopReason").Trigger is False
    line.simulation.inject("machines/filler/stop", 1.0)
    line.advance(3)
    reason = admin(line, "StopReason")
    shown = line.source.snapshot.values
    assert (reason.ID, reason.Value) == (shown["machines/filler/stop_reason"],) * 2
    assert (reason.Message, reason.Category, reason.Trigger) == ("fault stop", shown["machines/filler/category"], True)
    (alarm,) = admin(line, "Alarm")
    assert (alarm.Value, alarm.Trigger, admin(line, "AlarmExtent")) == (AlarmState.UNACKNOWLEDGED, True, 1)
    assert "filler" in alarm.Message and alarm.AckDateTime.year == 1601
    packer = line.node("machines/packer/PackML.Admin.ProdConsumedCount").read_value()
    assert packer[0].Count == shown["machines/packer/taken"]


def test_mode_and_speed_are_set_by_methods(line: Line) -> None:
    controller, engineer = line.client("controller"), line.client("engineer")
    line.advance(3)
    index = controller.get_namespace_index(NAMESPACE)
    line.node(OBJECT, controller).call_method(f"{index}:SetMachSpeed", ua.Variant(30.0, ua.VariantType.Float))
    with refused(Codes.BadOutOfRange):
        line.node(OBJECT, controller).call_method(f"{index}:SetMachSpeed", ua.Variant(3e4, ua.VariantType.Float))
    with refused(Codes.BadUserAccessDenied):
        line.node(OBJECT, controller).call_method(f"{index}:SetUnitMode", ua.Variant(3, ua.VariantType.Int32))
    call(controller, "Stop")
    line.advance(2)
    assert line.read("machines/filler/rate") == pytest.approx(0.5)
    line.node(OBJECT, engineer).call_method(f"{index}:SetUnitMode", ua.Variant(2, ua.VariantType.Int32))
    with refused(Codes.BadInvalidArgument):
        line.node(OBJECT, engineer).call_method(f"{index}:SetUnitMode", ua.Variant(9, ua.VariantType.Int32))
    line.advance()
    assert line.read(f"{OBJECT}.Status.UnitModeCurrent") == line.read("machines/filler/mode") == 2


def test_a_role_is_judged_before_the_state(line: Line) -> None:
    operator, viewer = line.client("operator"), line.client("viewer")
    index, before = operator.get_namespace_index(NAMESPACE), line.server.status()
    with refused(Codes.BadUserAccessDenied):
        line.node(OBJECT, operator).call_method(f"{index}:SetUnitMode", ua.Variant(2, ua.VariantType.Int32))
    with refused(Codes.BadInvalidArgument):
        line.node(OBJECT, operator).call_method(f"{index}:SetUnitMode", ua.Variant(3.0, ua.VariantType.Double))
    with refused(Codes.BadUserAccessDenied):
        line.node(OBJECT, viewer).call_method(f"{index}:SetMachSpeed", ua.Variant(30.0, ua.VariantType.Float))
    with refused(Codes.BadUserAccessDenied):
        call(viewer, "Hold")
    assert line.server.status().refused - before.refused == 4
    line.advance()
    assert line.read("machines/filler/mode") == 1
    assert [row[4] for row in line.outcomes()] == [False]


def test_a_speed_at_its_limit_is_the_limit() -> None:
    rate = number("machines/m/rate", "setpoint", "", "1/s", 0.0, 1.234567891)
    in_float = float(np.float32(rate.high * 60.0))
    assert _a_second(in_float, rate, True) == rate.high
    assert _a_second(rate.high * 60.0, rate, False) == rate.high
    assert _a_second(in_float, rate, False) != rate.high
    assert _a_second(30.0, rate, True) == 0.5

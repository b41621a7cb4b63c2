# SPDX-License-Identifier: Apache-2.0
"""Writes and methods: checked at once, applied at a tick, and read back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from asyncua import ua

from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING
from test.protocols.opcua.conftest import ROLES, refused

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"
Codes = ua.StatusCodes


def test_a_write_acts_at_the_next_tick_and_is_read_back(line: Line) -> None:
    line.advance(5)
    controller = line.client("controller")
    before = line.read(SETPOINT)
    line.node(SETPOINT, controller).write_value(0.125)
    assert line.read(SETPOINT) == before != 0.125  # no tick has passed
    line.advance()
    assert line.outcomes() == [("opcua controller", "set", (SETPOINT,), (0.125,), True)]
    assert line.read(SETPOINT) == 0.125
    assert line.read(f"{SETPOINT}/written_by") == "controller opcua controller"
    line.advance(200)
    assert line.read(SPEED) == pytest.approx(0.125)


def test_what_is_written_together_is_given_together(line: Line) -> None:
    controller = line.client("controller")
    nodes = [line.node(f"belts/zone{zone}/cmd_speed", controller) for zone in (1, 2, 3)]
    controller.write_values(nodes, [0.1, 0.2, 0.3])
    line.advance()
    names = tuple(f"belts/zone{zone}/cmd_speed" for zone in (1, 2, 3))
    assert line.outcomes() == [("opcua controller", "set", names, (0.1, 0.2, 0.3), True)]


REFUSED: list[tuple[str, object, ua.VariantType, int]] = [
    (SETPOINT, 1e6, ua.VariantType.Double, Codes.BadOutOfRange),
    (SETPOINT, float("nan"), ua.VariantType.Double, Codes.BadOutOfRange),
    (SETPOINT, 1, ua.VariantType.Int32, Codes.BadTypeMismatch),
    (SETPOINT, "0.1", ua.VariantType.String, Codes.BadTypeMismatch),
    (SETPOINT, [0.1], ua.VariantType.Double, Codes.BadTypeMismatch),
    (SETPOINT, None, ua.VariantType.Null, Codes.BadTypeMismatch),
    ("machines/filler/cntrl_cmd", 77, ua.VariantType.UInt32, Codes.BadOutOfRange),
    (SPEED, 0.1, ua.VariantType.Double, Codes.BadNotWritable),
    ("belts/zone1/trip", True, ua.VariantType.Boolean, Codes.BadNodeIdUnknown),
    ("run/state", 1, ua.VariantType.UInt32, Codes.BadNotWritable),
    ("belts/nowhere/speed", 0.1, ua.VariantType.Double, Codes.BadNodeIdUnknown),
]


def test_what_can_not_be_is_refused_at_once(line: Line) -> None:
    controller, before = line.client("controller"), line.server.status()
    for name, value, kind, code in REFUSED:
        with refused(code):
            line.node(name, controller).write_value(ua.DataValue(ua.Variant(value, kind)))
    line.advance()
    assert line.outcomes() == []
    assert line.server.status().refused - before.refused == len(REFUSED)


def test_only_values_can_be_written(line: Line) -> None:
    node = line.node(SETPOINT, line.client("test"))
    for attribute in (ua.AttributeIds.Description, ua.AttributeIds.AccessLevel, ua.AttributeIds.BrowseName):
        with refused(Codes.BadNotWritable):
            node.write_attribute(attribute, ua.DataValue(ua.Variant(1, ua.VariantType.Byte)))
    for name, value in ((SETPOINT, ua.Variant(0.1)), ("belts/zone1/mode", ua.Variant(3, ua.VariantType.UInt32))):
        with refused(Codes.BadWriteNotSupported):
            line.node(name, line.open[0]).write_value(ua.DataValue(value, ua.StatusCode(Codes.BadSensorFailure)))
    assert line.node(SETPOINT).read_description().Text != "1"


def test_the_mode_says_who_writes(line: Line) -> None:
    takes = {1: {"controller", "test"}, 2: {"engineer", "test"}, 3: {"operator", "engineer", "test"}}
    clients = {role: line.client(role) for role in ROLES}
    for mode, kinds in takes.items():
        line.node("line", clients["engineer"]).call_method(
            "2:set_mode", "belts/zone1", ua.Variant(mode, ua.VariantType.UInt32)
        )
        line.advance()
        assert line.read("belts/zone1/mode") == mode
        for role, client in clients.items():
            if role in kinds:
                line.node(SETPOINT, client).write_value(0.1)
            else:
                with refused(Codes.BadUserAccessDenied):
                    line.node(SETPOINT, client).write_value(0.1)


def test_a_device_is_put_into_a_mode_by_writing_that(line: Line) -> None:
    operator, mode = line.client("operator"), "belts/zone1/mode"
    kind = ua.VariantType.UInt32
    line.node(mode, operator).write_value(ua.Variant(3, kind))
    line.advance()
    assert line.read(mode) == 3
    line.node(SETPOINT, operator).write_value(0.1)
    line.advance()
    assert [row[:4] for row in line.outcomes()] == [
        ("opcua operator", "mode", ("belts/zone1",), (3.0,)),
        ("opcua operator", "set", (SETPOINT,), (0.1,)),
    ]
    for role, value, code in (
        ("controller", ua.Variant(1, kind), Codes.BadUserAccessDenied),
        ("viewer", ua.Variant(1, kind), Codes.BadUserAccessDenied),
        ("operator", ua.Variant(4, kind), Codes.BadOutOfRange),
        ("operator", ua.Variant(1.0, ua.VariantType.Double), Codes.BadTypeMismatch),
    ):
        with refused(code):
            line.node(mode, line.client(role)).write_value(value)
    line.advance()
    assert line.read(mode) == 3


def test_the_owner_of_the_line_shuts_other_controllers_out(line: Line) -> None:
    controller = line.client("controller")
    line.simulation.give(_own("plc", ("belts/zone2",)))
    line.advance()
    with refused(Codes.BadUserAccessDenied):
        line.node(SETPOINT, controller).write_value(0.1)
    line.node("belts/zone2/cmd_speed", controller).write_value(0.1)
    line.advance()
    assert line.outcomes()[-1] == ("opcua controller", "set", ("belts/zone2/cmd_speed",), (0.1,), True)


def test_more_writes_than_can_wait_are_refused(line: Line) -> None:
    node = line.node(SETPOINT, line.client("controller"))
    for _ in range(MOST_WAITING):
        node.write_value(0.1)
    with refused(Codes.BadTooManyOperations):
        node.write_value(0.1)
    line.advance()
    assert len(line.outcomes()) == MOST_WAITING
    node.write_value(0.2)


def test_methods_act_at_a_tick(line: Line) -> None:
    test, operator = line.client("test"), line.client("operator")
    of_test, of_operator = line.node("line", test), line.node("line", operator)
    of_test.call_method("2:inject", "belts/zone1/trip", 1.0)
    of_operator.call_method("2:force", "belts/zone2/speed", 0.7)
    line.advance()
    assert line.read("belts/zone1/fault") is True
    forced = line.node("belts/zone2/speed").read_data_value()
    assert (forced.Value.Value, forced.StatusCode.value) == (0.7, Codes.GoodLocalOverride)
    of_operator.call_method("2:acknowledge", "belts/zone1/tripped")
    of_operator.call_method("2:unforce", "")
    line.advance()
    assert [row[:3] for row in line.outcomes()] == [
        ("opcua test", "inject", ("belts/zone1/trip",)),
        ("opcua operator", "force", ("belts/zone2/speed",)),
        ("opcua operator", "acknowledge", ("belts/zone1/tripped",)),
        ("opcua operator", "unforce", ()),
    ]
    assert line.node("belts/zone2/speed").read_data_value().StatusCode.value == Codes.Good


def test_commands_given_by_the_method_write_act_together_or_not_at_all(line: Line) -> None:
    of_line = line.node("line", line.client("controller"))
    names = ["belts/zone1/run", SETPOINT]
    of_line.call_method("2:write", names, [0.0, 0.25])
    with refused(Codes.BadOutOfRange):
        of_line.call_method("2:write", names, [1.0, 99.0])
    with refused(Codes.BadInvalidArgument):
        of_line.call_method("2:write", names, [1.0])
    with refused(Codes.BadInvalidArgument):
        of_line.call_method("2:write", ["belts/zone1/speed"], [1.0])
    line.advance()
    assert line.outcomes() == [("opcua controller", "set", tuple(names), (0.0, 0.25), True)]


def test_calls_that_can_not_be_are_refused(line: Line) -> None:
    of_line = line.node("line", line.client("test"))
    whole = ua.Variant(3, ua.VariantType.UInt32)
    calls = [
        (("2:set_mode", "belts/nowhere", whole), Codes.BadInvalidArgument),
        (("2:set_mode", "belts/zone1"), Codes.BadArgumentsMissing),
        (("2:set_mode", "belts/zone1", whole, whole), Codes.BadTooManyArguments),
        (("2:set_mode", "belts/zone1", 3.0), Codes.BadInvalidArgument),
        (("2:acknowledge", "x" * 60_000), Codes.BadInvalidArgument),
        (("2:acknowledge", "x" * 100_000), Codes.BadEncodingLimitsExceeded),
        (("2:force", "belts/zone1/speed", float("inf")), Codes.BadInvalidArgument),
        (("2:inject", "belts/zone1/cmd_speed", 1.0), Codes.BadInvalidArgument),
    ]
    for (method, *arguments), code in calls:
        with refused(code):
            of_line.call_method(method, *arguments)
    line.advance()
    assert line.outcomes() == []


def _own(writer: str, released: tuple[str, ...]) -> object:
    from conveyor_sim.line.commands.inputs import OWN, Input

    return Input("lockstep", writer, "controller", OWN, (), (), released)


def test_an_operator_stops_a_machine_in_automatic_and_does_nothing_else(line: Line) -> None:
    node = line.node("machines/filler/cntrl_cmd", line.client("operator"))
    with refused(Codes.BadUserAccessDenied):
        node.write_value(ua.DataValue(ua.Variant(1, ua.VariantType.UInt32)))
    node.write_value(ua.DataValue(ua.Variant(3, ua.VariantType.UInt32)))
    line.advance()
    assert line.outcomes() == [("opcua operator", "set", ("machines/filler/cntrl_cmd",), (3.0,), True)]
    assert line.read("machines/filler/state") == 2


def refused_events(line: Line) -> list[tuple[str, float]]:
    return [(event.name, event.value) for event in line.source.events(0)[1] if event.kind == "command_refused"]


def test_a_mode_that_is_not_for_a_role_is_refused_at_once_and_on_record(line: Line) -> None:
    operator, before = line.client("operator"), line.server.status()
    maintenance = ua.Variant(2, ua.VariantType.UInt32)
    with refused(Codes.BadUserAccessDenied):
        line.node("belts/zone1/mode", operator).write_value(maintenance)
    with refused(Codes.BadUserAccessDenied):
        line.node("line", operator).call_method("2:set_mode", "belts/zone1", maintenance)
    after = line.server.status()
    assert (after.writes - before.writes, after.refused - before.refused) == (0, 2)
    line.advance()
    assert line.read("belts/zone1/mode") == 1
    assert [(row[:3], row[4]) for row in line.outcomes()] == [(("opcua operator", "mode", ("belts/zone1",)), False)] * 2
    assert refused_events(line)[-2:] == [("belts/zone1", 2.0)] * 2


def test_of_several_writes_each_is_judged_by_itself(line: Line) -> None:
    operator = line.client("operator")
    values = [
        ua.WriteValue(
            ua.NodeId(f"belts/zone{zone}/mode", 2),
            ua.AttributeIds.Value,
            Value=ua.DataValue(ua.Variant(mode, ua.VariantType.UInt32)),
        )
        for zone, mode in ((1, 3), (2, 2), (3, 9))
    ]
    codes = operator.tloop.post(operator.aio_obj.uaclient.write(ua.WriteParameters(values)))
    assert [code.value for code in codes] == [
        Codes.GoodCompletesAsynchronously,
        Codes.BadUserAccessDenied,
        Codes.BadOutOfRange,
    ]
    line.advance()
    assert [line.read(f"belts/zone{zone}/mode") for zone in (1, 2, 3)] == [3, 1, 1]


@pytest.mark.parametrize(
    ("method", "arguments", "codes"),
    [
        ("set_mode", ("belts/zone1", ua.Variant(9, ua.VariantType.UInt32)), (Codes.Good, Codes.BadOutOfRange)),
        ("set_mode", ("photo_eyes/full1", ua.Variant(3, ua.VariantType.UInt32)), (Codes.BadNodeIdUnknown, Codes.Good)),
        ("force", ("photo_eyes/full1/blocked", 0.5), (Codes.Good, Codes.BadOutOfRange)),
        ("force", ("machines/filler/state", 99.0), (Codes.Good, Codes.BadOutOfRange)),
        ("inject", ("belts/zone1/trip", 0.5), (Codes.Good, Codes.BadOutOfRange)),
        ("reset_counters", ("belts/zone1",), (Codes.BadNodeIdUnknown,)),
        ("shelve", ("alarm", -1.0), (Codes.BadNodeIdUnknown, Codes.Good)),
    ],
)
def test_an_argument_that_can_never_be_is_named(
    line: Line, method: str, arguments: tuple[object, ...], codes: tuple[int, ...]
) -> None:
    client, before = line.client("test"), line.server.status()
    given = [value if isinstance(value, ua.Variant) else ua.Variant(value) for value in arguments]
    request = ua.CallMethodRequest(ua.NodeId("line", 2), ua.NodeId(f"line/{method}", 2), given)
    (result,) = client.tloop.post(client.aio_obj.uaclient.call([request]))
    assert result.StatusCode.value == Codes.BadInvalidArgument
    assert tuple(code.value for code in result.InputArgumentResults) == codes
    after = line.server.status()
    assert (after.writes - before.writes, after.refused - before.refused) == (0, 1)
    line.advance()
    assert all(not row[4] for row in line.outcomes())

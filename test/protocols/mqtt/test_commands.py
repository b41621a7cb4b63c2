# SPDX-License-Identifier: Apache-2.0
"""Commands of hosts by MQTT: checked at once, recorded as inputs, and refused with a reason that hosts can read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from facts import missing

from conveyor_sim.line.commands.inputs import DISOWN, OWN
from conveyor_sim.protocols.mqtt import link
from conveyor_sim.protocols.mqtt.line_metrics import number_of
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING
from test.protocols.mqtt.kit import BOOLEAN, DOUBLE, LONG, SETPOINT, SPEED, Host, Payload, add_metric, properties_of

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Line, Mosquitto

INT32, STRING = 3, 12
MODE = "belts/zone1/mode"
MANUAL = 3


@pytest.fixture
def controlled(serve: Callable[..., Line]) -> Line:
    """Serve the zoned line, which a controller may command."""
    return serve(role="controller", silence=LONG)


def test_without_a_role_nobody_commands(serve: Callable[..., Line]) -> None:
    line = serve()
    line.host.set(SETPOINT, 0.1)
    assert missing(line.refused(1), "command", "read-only") == []
    line.advance()
    assert line.outcomes() == [] and line.node.status().writes == 0
    assert properties_of(line.host.last("DBIRTH").metrics[SETPOINT])["readOnly"] is True


def test_an_operator_takes_a_belt_in_manual_and_slows_it_down(line: Line) -> None:
    line.host.set(SETPOINT, 0.1)
    assert missing(line.refused(1), "belts/zone1: is in Automatic", ["Manual"]) == []
    line.host.set(MODE, MANUAL, INT32)
    line.until(lambda: line.node.status().writes == 1, "the mode")
    line.advance()
    assert line.host.values[MODE] == MANUAL
    line.host.set(SETPOINT, 0.1)
    line.until(lambda: line.node.status().writes == 2, "the setpoint")
    assert line.host.values[SETPOINT] != 0.1  # no tick has passed
    line.advance(200)
    assert line.host.values[SETPOINT] == 0.1 and line.host.values[SPEED] == pytest.approx(0.1)
    writer = f"mqtt 127.0.0.1:{line.broker.port}"
    assert line.outcomes() == [
        (writer, "mode", ("belts/zone1",), (3.0,), True),
        (writer, "set", (SETPOINT,), (0.1,), True),
    ]


def test_what_comes_in_one_message_acts_together_or_not_at_all(controlled: Line) -> None:
    line, other = controlled, "belts/zone2/cmd_speed"
    line.host.send("DCMD", [(SETPOINT, DOUBLE, 0.1), (other, DOUBLE, 0.2)])
    line.until(lambda: line.node.status().writes == 1, "both")
    line.advance()
    assert [row[1:] for row in line.outcomes()] == [
        (OWN, (), (), True),
        ("set", (SETPOINT, other), (0.1, 0.2), True),
    ]
    line.host.send("DCMD", [(SETPOINT, DOUBLE, 0.3), (other, DOUBLE, 99.0)])
    assert line.refused(1).startswith(f"{other}: 99 given, expected 0 to 1 m/s")
    line.advance()
    assert line.outcomes() == [] and line.host.values[SETPOINT] == 0.1


@pytest.mark.parametrize(
    ("metrics", "reason"),
    [
        ([(SETPOINT, DOUBLE, 1e6)], f"{SETPOINT}: 1e+06 given, expected 0 to 1 m/s"),
        ([(SETPOINT, DOUBLE, float("nan"))], f"{SETPOINT}: nan given, expected 0 to 1 m/s"),
        ([(SETPOINT, INT32, 1)], f"{SETPOINT}: no value of its data type given, expected number, as its birth has it"),
        ([(SETPOINT, STRING, "0.1")], f"{SETPOINT}: no value of its data type given, expected number"),
        ([(SETPOINT, DOUBLE, None)], f"{SETPOINT}: no value of its data type given, expected number"),
        ([(SETPOINT, DOUBLE, 0.1), (SETPOINT, DOUBLE, 0.2)], f"{SETPOINT}: given twice"),
        ([(SPEED, DOUBLE, 0.1)], f"{SPEED}: can't be commanded, expected a metric that is not readOnly"),
        ([("no/such\x07", DOUBLE, 0.1)], "no/such\\x07: can't be commanded"),
        ([(SETPOINT, DOUBLE, 0.1), (MODE, INT32, MANUAL)], f"{MODE}: given with commands, expected modes in a message"),
        ([(MODE, INT32, MANUAL)], "mode: given by controller mqtt 127.0.0.1:"),
        ([], "0 metrics given, expected 1 to 1000"),
        ([(SETPOINT, DOUBLE, 0.1)] * 1001, "1001 metrics given, expected 1 to 1000"),
    ],
)
def test_what_can_not_be_is_refused_with_the_reason(controlled: Line, metrics: Any, reason: str) -> None:
    controlled.host.send("DCMD", metrics)
    assert controlled.refused(1).startswith(reason)
    controlled.advance()
    assert controlled.outcomes() == []


def test_a_mode_that_there_is_not_is_refused(line: Line) -> None:
    line.host.set(MODE, 7, INT32)
    assert line.refused(1).startswith("belts/zone1: 7 given, expected 1 to 3")


def test_the_edge_node_takes_nothing_but_the_request_for_births(line: Line) -> None:
    line.host.send("NCMD", [(SETPOINT, DOUBLE, 0.1)])
    assert line.refused(1).startswith(f"{SETPOINT}: given to the edge node, expected Node Control/Rebirth as a Boolean")
    line.host.send("NCMD", [("Node Control/Rebirth", INT32, 1)])
    assert line.refused(2).startswith("Node Control/Rebirth: given to the edge node")
    line.host.send("NCMD", [("Node Control/Rebirth", BOOLEAN, False)])
    line.advance()
    assert line.host.kinds().count("NBIRTH") == 1


def test_a_command_that_the_broker_has_kept_is_not_obeyed(serve: Callable[..., Line], broker: Mosquitto) -> None:
    """It would act again at each connection."""
    host = Host(broker.port)
    host.send("DCMD", [(MODE, INT32, MANUAL)], retain=True)
    host.state(True, 1)  # by then the broker has the one before, too
    host.close()
    line = serve(role="operator")
    assert missing(line.refused(1), "broker", "retain") == []
    line.advance()
    assert line.outcomes() == []


def test_payloads_that_are_none_end_nothing(line: Line) -> None:
    good = Payload()
    add_metric(good, SETPOINT, DOUBLE, 0.1, 1)
    noise = [
        b"",
        b"\x00",
        b"\xff" * 1000,
        good.SerializeToString()[:-3],
        b"\x12\x05\x0a\x03\xff\xfe\xfd",
        bytes(range(256)) * 100,
        b'{"metrics": []}',
    ]
    for data in noise:
        for kind in ("NCMD", "DCMD"):
            line.host.send_bytes(kind, data)
    line.until(lambda: line.node.status().refused == 2 * len(noise), "refusals")
    line.advance()
    assert line.outcomes() == [] and line.host.kinds().count("NBIRTH") == 1


def test_what_is_too_large_never_comes_here(line: Line) -> None:
    """By MQTT 5 the broker keeps it to itself; the connection stays."""
    line.host.send_bytes("DCMD", b"\x00" * 50 * link.MOST_BYTES)
    line.host.set(SETPOINT, 99.0)
    assert line.refused(1).startswith(SETPOINT)
    assert line.host.kinds().count("NBIRTH") == 1


def test_commands_as_fast_as_they_come_are_bounded_and_hold_up_nobody(controlled: Line) -> None:
    """The broker drops some itself: all are of quality of service 0."""
    line = controlled

    def flood() -> bool:
        for _ in range(500):
            line.host.set(SETPOINT, 0.1)
        return line.node.status().refused > 0

    line.until(flood, "a refusal")
    assert line.node.status().writes < MOST_WAITING  # to take the line is an input, too
    line.advance()
    assert len(line.outcomes()) <= MOST_WAITING

    def is_heard() -> bool:
        line.host.set(SETPOINT, 0.2)
        line.advance()
        return line.host.values[SETPOINT] == 0.2

    line.until(is_heard, "the next command")
    assert line.host.kinds().count("NBIRTH") == 1


def test_a_controller_holds_the_line_until_it_has_been_silent(serve: Callable[..., Line]) -> None:
    line = serve(role="controller", silence=0.2)
    line.host.set(SETPOINT, 0.1)
    line.until(lambda: line.node.status().writes == 1, "the command")
    line.advance()
    assert line.simulation.line.modes.owner == f"mqtt 127.0.0.1:{line.broker.port}"
    line.until(lambda: line.source._waiting, "its release")
    line.advance()
    assert line.simulation.line.modes.owner == ""
    assert [row[1] for row in line.outcomes()] == [OWN, "set", DISOWN]


def test_a_controller_holds_nothing_without_the_broker(controlled: Line) -> None:
    line = controlled
    line.host.set(SETPOINT, 0.1)
    line.until(lambda: line.node.status().writes == 1, "the command")
    line.advance()
    line.broker.kill()
    line.until(lambda: line.source._waiting, "its release")
    line.source.before_tick()
    line.simulation.advance()
    assert [row[1] for row in line.outcomes()] == [OWN, "set", DISOWN]


def test_a_float_is_taken_for_a_double_and_a_limit_in_it_is_the_limit(controlled: Line) -> None:
    tag = replace(next(tag for tag in controlled.source.info.tags if tag.name == SETPOINT), high=0.6)
    payload = Payload()
    for name, value in ((SETPOINT, 0.25), (SETPOINT, 0.6), (SETPOINT, 0.6000001)):
        payload.metrics.add(name=name, datatype=9).float_value = value
    metrics = Payload.FromString(payload.SerializeToString()).metrics
    quarter, limit, beyond = (number_of(tag, metric) for metric in metrics)
    assert (quarter, limit) == (0.25, 0.6) and beyond is not None and beyond > 0.6
    one = Payload()
    one.metrics.add(name=SETPOINT, datatype=9).float_value = 0.25
    controlled.host.send_bytes("DCMD", one.SerializeToString())
    controlled.until(lambda: controlled.node.status().writes == 1, "the setpoint")
    controlled.advance()
    assert controlled.outcomes()[-1][2:] == ((SETPOINT,), (0.25,), True)


def test_a_mode_that_is_not_for_operators_is_refused_at_once(line: Line) -> None:
    line.host.set(MODE, 2, INT32)
    assert missing(line.refused(1), "belts/zone1", "Maintenance", "engineer") == []
    assert line.node.status().writes == 0
    line.advance()
    assert [row[1:] for row in line.outcomes()] == [("mode", ("belts/zone1",), (2.0,), False)]
    assert line.host.values[MODE] == 1

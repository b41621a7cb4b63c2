# SPDX-License-Identifier: Apache-2.0
"""The operator panel over protocol servers: who may use it, presses within a tick, and buttons whose client leaves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from facts import missing

from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.inputs import OWN, SET, Input
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING
from conveyor_sim.support.modbus_rows import Row
from conveyor_sim.testing.scenario import Scenario
from test.protocols.waiting import until

LINE = "scenarios/panel_line"
START, CONTACT = "panel/start/press", "panel/start/contact"


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Scenario]:
    """The line with a panel, owned by a controller, recorded; its recording replays bit for bit."""
    with Scenario(LINE, bag=tmp_path / "bag") as plant:
        plant.simulation.give(Input("plc", "plc", "controller", OWN, (), ()))
        plant.run_for(0.01)
        yield plant
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None


def contacts(line: Scenario, ticks: int = 3) -> list[float]:
    """Return the contact of the start button after each of the next ticks."""
    seen = []
    for _ in range(ticks):
        line.run_for(0.01)
        seen.append(line.signals[CONTACT])
    return seen


# Modbus


@contextmanager
def modbus_client(server: Any) -> Iterator[Any]:
    client_of = pytest.importorskip("pymodbus.client").ModbusTcpClient
    with client_of("127.0.0.1", port=server.port, timeout=20) as client:
        yield client


def rows_of(line: Scenario) -> dict[str, Row]:
    from conveyor_sim.protocols.modbus.address_map import modbus_map

    return {row.name: row for row in modbus_map(line.simulation.process_image.tags)}


def test_a_modbus_panel_presses_turns_and_sets(modbus: Any, line: Scenario) -> None:
    rows = rows_of(line)
    assert rows[START].table == "coil" and rows[CONTACT].table == "discrete input"
    with modbus_client(modbus(line, role="operator")) as client:
        for value in (True, False):
            assert not client.write_coil(rows[START].address, value).isError()
        assert contacts(line) == [1.0, 0.0, 0.0]
        assert not client.write_register(rows["panel/mode/turn"].address, 0).isError()
        words = client.convert_to_registers(0.4, client.DATATYPE.FLOAT32)
        assert not client.write_registers(rows["panel/speed/set"].address, words).isError()
        assert not client.write_coil(rows["panel/estop/press"].address, True).isError()
        line.run_for(0.01)
        assert line.signals["panel/mode/position"] == 0.0 and line.signals["panel/estop/contact"] == 0.0
        assert line.signals["panel/speed/value"] == pytest.approx(0.4)
        assert client.write_register(rows["panel/mode/turn"].address, 2).exception_code == 3
        for wrong in (0.7, float("nan"), float("inf")):
            words = client.convert_to_registers(wrong, client.DATATYPE.FLOAT32)
            assert client.write_registers(rows["panel/speed/set"].address, words).exception_code == 3


def test_a_modbus_plc_and_a_read_only_server_press_nothing(modbus: Any, line: Scenario) -> None:
    rows = rows_of(line)
    for role, code in (("controller", 3), (None, 1)):
        with modbus_client(modbus(line, role=role)) as client:
            assert client.write_coil(rows["panel/estop/press"].address, True).exception_code == code
    assert contacts(line, 1) == [0.0] and line.signals["panel/estop/contact"] == 1.0


def test_a_button_is_released_when_its_modbus_connection_ends(modbus: Any, line: Scenario) -> None:
    rows, server = rows_of(line), modbus(line, role="operator")
    with modbus_client(server) as client:
        assert not client.write_coil(rows[START].address, True).isError()
        assert contacts(line, 5) == [1.0] * 5
    until(lambda: server.status().clients == 0, "the end of the connection")
    assert contacts(line) == [0.0] * 3


def test_a_flood_of_presses_is_refused_and_leaves_no_button_pressed(modbus: Any, line: Scenario) -> None:
    rows, server = rows_of(line), modbus(line, role="operator")
    with modbus_client(server) as client:
        codes = {
            client.write_coil(rows[START].address, number % 2 == 1).exception_code
            for number in range(MOST_WAITING + 20)
        }
        assert 6 in codes
    until(lambda: server.status().clients == 0, "the end of the connection")
    until(lambda: contacts(line, 1) == [0.0], "the release, for which the queue had no room")


# OPC UA


@contextmanager
def opcua_client(server: Any, user: str = "") -> Iterator[Any]:
    client = pytest.importorskip("asyncua.sync").Client(server.address, timeout=60, watchdog_intervall=60)
    if user:
        client.set_user(user)
        client.set_password("geheim")
    with client:
        yield client


def node(client: Any, name: str) -> Any:
    return client.get_node(f"ns=2;s={name}")


def test_an_operator_uses_the_panel_by_opcua_and_others_do_not(opcua: Any, line: Scenario) -> None:
    ua = pytest.importorskip("asyncua").ua
    server = opcua(
        line, users={"jo": ("operator", "geheim"), "plc": ("controller", "geheim"), "vic": ("viewer", "geheim")}
    )
    for user in ("", "vic", "plc"):
        with opcua_client(server, user) as client, pytest.raises(ua.UaStatusCodeError, match="BadUserAccessDenied"):
            node(client, "panel/estop/press").write_value(True)
    with opcua_client(server, "jo") as client:
        for value in (True, False):
            node(client, START).write_value(value)
        assert contacts(line) == [1.0, 0.0, 0.0]
        client.get_node("ns=2;s=line").call_method("2:write", ["panel/mode/turn", "panel/speed/set"], [0.0, 0.4])
        line.run_for(0.01)
        assert (line.signals["panel/mode/position"], line.signals["panel/speed/value"]) == (0.0, 0.4)
        with pytest.raises(ua.UaStatusCodeError, match="BadTypeMismatch"):
            node(client, START).write_value(1.0)
        for wrong in (float("nan"), 0.7):
            with pytest.raises(ua.UaStatusCodeError, match="BadOutOfRange"):
                node(client, "panel/speed/set").write_value(wrong)
        node(client, START).write_value(True)
        assert contacts(line) == [1.0] * 3
    assert contacts(line)[-1] == 0.0


def test_the_last_of_two_clients_holds_a_button(opcua: Any, line: Scenario) -> None:
    server = opcua(line, users={"jo": ("operator", "geheim")})
    with opcua_client(server, "jo") as second:
        with opcua_client(server, "jo") as first:
            node(first, START).write_value(True)
            line.run_for(0.01)
            node(second, START).write_value(True)
        assert contacts(line) == [1.0] * 3
    assert contacts(line)[-1] == 0.0


# Sparkplug


def test_a_sparkplug_host_uses_the_panel_and_is_released_after_a_silence(line: Scenario) -> None:
    kit = pytest.importorskip("test.protocols.mqtt.kit")
    from conveyor_sim.protocols.mqtt.commands import HostCommands

    def message(*metrics: tuple[str, int, Any]) -> bytes:
        payload = kit.Payload()
        for metric in metrics:
            kit.add_metric(payload, *metric, 0)
        return bytes(payload.SerializeToString())

    source = line.source()
    hosts = HostCommands(source, "operator", "broker", silence=0.0)
    for value in (True, False):
        hosts.take_line(message((START, kit.BOOLEAN, value)))
    assert contacts(line) == [1.0, 0.0, 0.0]
    hosts.take_line(message((START, kit.BOOLEAN, True), ("panel/speed/set", kit.DOUBLE, 0.4)))
    assert contacts(line) == [1.0] * 3 and line.signals["panel/speed/value"] == 0.4
    hosts.look()
    assert contacts(line) == [0.0] * 3
    refused = hosts.refused
    for wrong in (float("nan"), 0.7):
        hosts.take_line(message(("panel/speed/set", kit.DOUBLE, wrong)))
    hosts.take_line(message((START, kit.DOUBLE, 1.0)))
    hosts.take_line(message(("panel/nobody/press", kit.BOOLEAN, True)))
    assert hosts.refused == refused + 4
    plc = HostCommands(source, "controller", "broker")
    plc.take_line(message((START, kit.BOOLEAN, True)))
    assert plc.refused == 1 and missing(plc.refusal, START, "controller", "operator") == []


# All of them


def test_a_release_waits_for_room_in_the_queue(line: Scenario) -> None:
    source = line.source()
    held, press = HeldButtons(source), Input("web", "web jo", "operator", SET, (START,), (1.0,))
    assert source.give(press) == ""
    held.note("page", press)
    while not source.give(press._replace(names=("panel/speed/set",), values=(0.3,))):
        pass
    held.leave("page")
    held.look()
    assert contacts(line) == [1.0] * 3
    held.look()
    assert contacts(line) == [0.0] * 3


def test_maintained_buttons_and_emergency_stops_keep_their_state() -> None:
    parts = {"pump": {"kind": "button", "action": "maintained"}, "estop": {"kind": "emergency_stop"}}
    with Scenario(LINE, {"panel": parts}) as line:
        source = line.source()
        held = HeldButtons(source)
        for name in ("panel/pump/pressed", "panel/estop/press"):
            press = Input("web", "web jo", "operator", SET, (name,), (1.0,))
            source.give(press)
            held.note("page", press)
        line.run_for(0.01)
        held.leave("page")
        line.run_for(0.05)
        assert (line.signals["panel/pump/contact"], line.signals["panel/estop/contact"]) == (1.0, 0.0)

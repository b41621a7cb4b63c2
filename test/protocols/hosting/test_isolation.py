# SPDX-License-Identifier: Apache-2.0
"""Protocol servers in separate processes: one stalls or is killed, and the line and the others go on."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from protocols.modbus.modbus_line import speed_of
from protocols.served import Served
from protocols.waiting import PATIENCE, alone, until

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.protocols.hosting.server_messages import BEAT
from conveyor_sim.protocols.server.users import MOST_WRONG, line_of, new_user

pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")
pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")
pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from aiohttp import ClientSession
from asyncua.sync import Client
from asyncua.ua import UaStatusCodeError
from pymodbus.client import ModbusTcpClient

SCENE = "scenarios/zoned_line"
PASSWORD = "open sesame"
BUSY = 6
TICK = 65_534
"""Address of the two registers of the handshake."""


class Line(Served):
    """The zoned line, served by all servers of this machine that need no broker."""

    def __init__(self, folder: Path, certificates: Path) -> None:
        users = {name: new_user(role, PASSWORD) for name, role in (("op", "operator"), ("plc", "controller"))}
        (folder / "users").write_text("".join(f"{line_of(name, user)}\n" for name, user in users.items()))
        servers = ["--opcua", "0", "--modbus", "0", "--web", "0", "--modbus-role", "controller"]
        others = ["--users", "users", "--opcua-certificates", str(certificates), "--out", "bag"]
        super().__init__(folder, SCENE, *servers, *others, "--duration", "1000")
        until(lambda: self.told.count("clients can") == 3 or self.process.poll() is not None, "the servers")
        pattern = r"(opc\.tcp|modbus|http)://127\.0\.0\.1:(\d+)"
        self.ports = {scheme: int(port) for scheme, port in re.findall(pattern, self.told)}

    @property
    def page(self) -> str:
        return f"http://127.0.0.1:{self.ports['http']}"

    def modbus(self, machine: str = "127.0.0.1") -> ModbusTcpClient:
        """Connect a client from one of the addresses of this machine; it reconnects by itself."""
        return ModbusTcpClient(
            "127.0.0.1", port=self.ports["modbus"], timeout=2, retries=0, source_address=(machine, 0)
        )

    def opcua(self, user: str = "", password: str = PASSWORD) -> Client:
        client = Client(f"opc.tcp://127.0.0.1:{self.ports['opc.tcp']}", timeout=PATIENCE, watchdog_intervall=PATIENCE)
        if user:
            client.set_user(user)
            client.set_password(password)
        try:
            client.connect()
        except BaseException:
            client.tloop.stop()
            raise
        return client

    def lets_in(self, user: str, password: str = PASSWORD) -> bool:
        """Return True if OPC UA accepts a password."""
        try:
            self.opcua(user, password).disconnect()
        except UaStatusCodeError:
            return False
        return True

    def signs_in(self, user: str, password: str = PASSWORD) -> bool:
        """Return True if the page accepts a password."""

        async def work() -> bool:
            async with ClientSession() as session, session.ws_connect(f"{self.page}/live", origin=self.page) as page:
                await page.send_json({"do": "sign_in", "id": 1, "name": user, "password": password})
                while True:
                    data = (await page.receive(PATIENCE)).data
                    if data[0] == 0 and (message := json.loads(data[1:]))["kind"] == "reply":
                        return not message["refused"]

        return alone(work())

    def health(self) -> dict[str, dict[str, Any]]:
        """Return the health of the protocol servers by name, as the page gets it; empty before that."""

        async def work() -> dict[str, dict[str, Any]]:
            async with ClientSession() as session, session.ws_connect(f"{self.page}/live", origin=self.page) as page:
                data = (await page.receive(PATIENCE)).data
                return {each["name"]: each for each in json.loads(data[1:])["status"]["servers"]}

        return alone(work())


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Line]:
    """Serve one line for all tests of this file, which leave it running."""
    served = Line(tmp_path_factory.mktemp("line"), tmp_path_factory.mktemp("certificates") / "own")
    yield served
    if served.process.poll() is None:
        served.process.kill()
        served.process.wait()


def code_of(client: ModbusTcpClient, value: float) -> int:
    """Return the exception code of a write of the first belt's speed; 0: none."""
    answer = client.write_registers(0, client.convert_to_registers(value, client.DATATYPE.FLOAT32))
    return int(answer.exception_code) if answer.isError() else 0


def kill(line: Line, protocol: str, number: int = signal.SIGKILL) -> int:
    """Kill a protocol server; return its process once another has taken its place."""
    before = line.server(protocol)
    os.kill(before, number)
    until(lambda: any(c.split("\0")[-2:-1] == [protocol] and p != before for p, c in line.children.items()), "another")
    return line.server(protocol)


def test_each_server_has_a_process_of_its_own(line: Line) -> None:
    assert len({line.server(protocol) for protocol in ("opcua", "modbus", "web")}) == 3
    assert len(line.children) == 4, "with the one that simulates"


def test_a_stalled_server_is_restarted_on_its_port_while_the_others_answer(line: Line) -> None:
    stalled = line.server("opcua")
    os.kill(stalled, signal.SIGSTOP)
    ended = "opcua: the protocol server has not answered for 5 s, and was ended; it is restarted on opc.tcp://127.0.0.1"
    with line.modbus() as client:
        answers = 0
        while ended not in line.told:
            assert speed_of(client) is not None and urlopen(line.page, timeout=PATIENCE).status == 200
            answers += 1
    assert answers > 10
    client = None

    def connected() -> bool:
        nonlocal client
        try:
            client = line.opcua()
        except OSError:
            return False
        return True

    until(connected, "the other server")
    assert client is not None
    node = client.get_node("ns=2;s=run/tick")
    tick = node.read_value()
    until(lambda: node.read_value() > tick, "ticks")
    client.disconnect()
    assert line.server("opcua") != stalled
    until(lambda: line.health().get("opcua", {}).get("restarts") == 1, "that the page says so")


def test_the_line_stays_with_its_controller_through_a_restart(line: Line) -> None:
    """A client that comes back has another port, and so another name, but the same machine."""
    with line.modbus() as plc, line.modbus("127.0.0.2") as other:
        assert code_of(plc, 0.25) == 0
        until(lambda: speed_of(plc) == 0.25, "the speed")
        assert code_of(other, 0.3) == BUSY
        time.sleep(5 * BEAT)  # counts are as of the last heartbeat
        kill(line, "modbus")
        until(lambda: speed_of(other) is not None, "the other server")
        assert code_of(other, 0.3) == BUSY
        until(lambda: speed_of(plc) is not None, "the other server")
        assert code_of(plc, 0.375) == 0
        until(lambda: speed_of(plc) == 0.375, "the speed")
        assert code_of(other, 0.3) == BUSY
    assert "modbus: the protocol server was killed by signal 9; it is restarted on modbus://" in line.told


def test_a_parent_that_does_not_answer_refuses_what_then_never_acts(line: Line) -> None:
    with line.modbus() as client:
        before = speed_of(client)
        line.process.send_signal(signal.SIGSTOP)
        try:
            assert code_of(client, 0.125) == BUSY
        finally:
            line.process.send_signal(signal.SIGCONT)
        ticks = client.read_input_registers(TICK, count=2).registers
        until(lambda: client.read_input_registers(TICK, count=2).registers > ticks, "ticks")
        assert speed_of(client) == before


def test_wrong_passwords_count_for_all_servers_and_through_a_restart(line: Line) -> None:
    assert line.signs_in("op") and line.lets_in("op")
    for number in range(MOST_WRONG - 2):
        assert not line.lets_in("op", f"wrong {number}")
    port = line.ports["opc.tcp"]
    kill(line, "opcua")

    def listens() -> bool:
        try:
            socket.create_connection(("127.0.0.1", port), PATIENCE).close()
        except OSError:
            return False
        return True

    until(listens, "the other server")
    assert not line.lets_in("op", "wrong again") and not line.signs_in("op", "wrong, too")
    assert not line.signs_in("op") and not line.lets_in("op"), "too many were wrong"
    assert line.lets_in("plc") and line.signs_in("plc"), "others are let in"


def test_ctrl_c_ends_it_in_order_though_a_server_is_stalled(line: Line) -> None:
    """It runs last on the shared line: commands are on record, and counted across restarts."""
    os.kill(line.server("opcua"), signal.SIGSTOP)
    children = line.children
    out = line.end()
    assert line.process.returncode == 0
    assert re.search(
        r"modbus 2 written, 4 refused, restarted 1 time, web 0 written, 0 refused; recorded to bag\n$", out
    )
    assert not any(Path(f"/proc/{pid}").exists() for pid in children)
    bag = line.folder / "bag"
    report = replay(bag)
    assert report.exact and report.difference is None
    with open_bag(bag) as found:
        outcomes = [frame.data for frame in found.outcomes()]
    assert all(outcome.accepted for outcome in outcomes)
    assert [outcome.operation for outcome in outcomes] == ["own", "set", "disown", "own", "set", "disown"]
    assert len({outcome.writer for outcome in outcomes}) == 2


def test_nothing_is_left_of_a_parent_that_is_killed(command: Callable[..., Served]) -> None:
    """Even a stopped server ends, which can't react itself."""
    served = command(SCENE, "--modbus", "0", "--web", "0", "--no-record")
    until(lambda: served.told.count("clients can") == 2, "the servers")
    children = served.children
    assert len(children) == 3
    os.kill(served.server("web"), signal.SIGSTOP)
    served.end(signal.SIGKILL)
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in children), "the end of all")


def test_a_server_that_can_not_start_leaves_no_other_behind(command: Callable[..., Served], tmp_path: Path) -> None:
    served = command(SCENE, "--modbus", "0", "--opcua", "0", "--opcua-history", "belts/*/sped", "--no-record")
    served.process.wait(timeout=PATIENCE)
    assert served.process.returncode == 1
    assert "Error: opcua: history of belts/*/sped: fits no tag" in served.told and "clients can" not in served.told
    assert "Traceback" not in served.told

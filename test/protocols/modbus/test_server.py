# SPDX-License-Identifier: Apache-2.0
"""A line over Modbus TCP, with independent clients: they read the values of the simulation, and writes act at a tick or
are refused with an exception.
"""

from __future__ import annotations

import shutil
import socket
import struct
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator

import pytest
from protocols.modbus.modbus_line import (
    BUSY,
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    NO_RESPONSE,
    SETPOINT,
    SHORT,
    SPEED,
    Line,
    serving,
)

from conveyor_sim.bag.messages.encode import Header, line_message
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.line.commands.inputs import DISOWN, OWN
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.modbus.address_map import HANDSHAKE
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.server.quotas import QUOTA
from conveyor_sim.protocols.tags.line_mirror import LineMirror
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING, Control

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from pymodbus.client import ModbusTcpClient

from conveyor_sim.protocols.modbus.server import ModbusServer


@pytest.fixture(params=["operator"])
def line(request: pytest.FixtureRequest) -> Iterator[Line]:
    """Serve the zoned line, with the role that the test states; None: clients may not write."""
    with serving(request.param) as found:
        yield found


controller = pytest.mark.parametrize("line", ["controller"], indirect=True)


def test_every_tag_reads_as_the_simulation_shows_it(line: Line) -> None:
    line.advance(400)
    shown = dict(zip(line.simulation.process_image.signal_names, line.simulation.signals(), strict=True))
    assert shown[SPEED] > 0.0 and shown["machines/filler/produced"] >= 1.0
    for name, value in shown.items():
        assert line.read(name) == pytest.approx(value, rel=1e-6), name
    for tag in line.simulation.process_image.commands:
        assert line.read(tag.name) == pytest.approx(tag.initial, rel=1e-6), tag.name


def test_times_keep_their_microseconds(line: Line) -> None:
    assert line.rows["photo_eyes/full1/rose"].type == "float64"
    line.advance(1500)
    time = line.simulation.signals()[line.simulation.process_image.signal_names.index("photo_eyes/full1/rose")]
    assert time > 1.0
    assert line.read("photo_eyes/full1/rose") == time


@controller
def test_a_write_acts_at_the_next_tick_and_is_read_back(line: Line) -> None:
    assert not line.write(SETPOINT, 0.1).isError()
    assert line.read(SETPOINT) != pytest.approx(0.1)  # no tick has passed
    line.advance()
    taken, outcome = line.simulation.take_outcomes()
    assert taken.accepted and (taken.operation, taken.input.writer) == (OWN, outcome.input.writer)
    assert outcome.accepted, outcome.reason
    assert (outcome.names, outcome.values) == ((SETPOINT,), (0.1,))  # as it was typed, not as a float32
    given = outcome.input
    assert (given.source, given.writer_kind) == ("modbus", "controller")
    assert given.writer == f"modbus 127.0.0.1:{line.client.socket.getsockname()[1]}"
    assert line.read(SETPOINT) == pytest.approx(0.1)
    line.advance(200)
    assert line.read(SPEED) == pytest.approx(0.1)


@controller
def test_values_that_come_in_one_request_act_together_or_not_at_all(line: Line) -> None:
    coils = sorted((row for row in line.rows.values() if row.table == "coil"), key=lambda row: row.address)
    assert len(coils) >= 2
    assert not line.client.write_coils(0, [True, False]).isError()
    line.advance()
    _, outcome = line.simulation.take_outcomes()
    assert outcome.names == (coils[0].name, coils[1].name)
    row = line.rows[SETPOINT]
    good = line.client.convert_to_registers(0.1, line.client.DATATYPE.FLOAT32)
    beyond = line.client.convert_to_registers(1e6, line.client.DATATYPE.FLOAT32)
    assert line.client.write_registers(row.address, good + beyond).exception_code == ILLEGAL_VALUE
    line.advance()
    assert line.simulation.take_outcomes() == []


@controller
def test_what_can_not_be_gets_an_exception(line: Line) -> None:
    client, setpoint = line.client, line.rows[SETPOINT]
    too_much = client.convert_to_registers(1e6, client.DATATYPE.FLOAT32)
    not_a_number = client.convert_to_registers(float("nan"), client.DATATYPE.FLOAT32)
    answers = [
        (client.write_registers(setpoint.address, too_much), ILLEGAL_VALUE),
        (client.write_registers(setpoint.address, not_a_number), ILLEGAL_VALUE),
        (client.write_register(setpoint.address, 1), ILLEGAL_ADDRESS),  # half of a value
        (client.write_registers(setpoint.address + 1, too_much), ILLEGAL_ADDRESS),
        (client.write_coil(60000, True), ILLEGAL_ADDRESS),
        (client.read_holding_registers(60000), ILLEGAL_ADDRESS),
        (client.read_input_registers(65535, count=2), ILLEGAL_ADDRESS),
        (client.diag_restart_communication(True), ILLEGAL_FUNCTION),
        (client.read_device_information(), ILLEGAL_FUNCTION),
    ]
    assert [answer.exception_code for answer, _ in answers] == [code for _, code in answers]
    line.advance()
    assert line.simulation.take_outcomes() == []
    status = line.server.status()
    assert (status.writes, status.refused) == (0, 5)
    assert status.latency > 0.0 == line.server.status().latency


@pytest.mark.parametrize("line", [None], indirect=True)
def test_without_a_role_nobody_writes(line: Line) -> None:
    assert line.write(SETPOINT, 0.1).exception_code == ILLEGAL_FUNCTION
    line.advance()
    assert line.simulation.take_outcomes() == []
    assert line.read(SETPOINT) == pytest.approx(line.simulation.process_image.commands[0].initial)


def test_no_operator_says_how_far_a_line_in_lockstep_goes(line: Line) -> None:
    assert line.client.write_registers(HANDSHAKE, [0, 1]).exception_code == ILLEGAL_FUNCTION


@controller
def test_a_line_that_is_not_in_lockstep_takes_no_target(line: Line) -> None:
    assert line.client.write_registers(HANDSHAKE, [0, 1]).exception_code == BUSY


@controller
def test_more_writes_than_can_wait_are_refused_and_no_more_is_kept(line: Line) -> None:
    codes = [line.write(SETPOINT, 0.1).isError() for _ in range(MOST_WAITING + 5)]
    assert codes == [False] * (MOST_WAITING - 1) + [True] * 6  # to take the line is an input, too
    assert line.write(SETPOINT, 0.1).exception_code == BUSY
    line.advance()
    assert len(line.simulation.take_outcomes()) == MOST_WAITING
    assert not line.write(SETPOINT, 0.2).isError()


READ_COIL = struct.pack(">HHHBBHH", 1, 0, 6, 1, 1, 0, 1)
"""Packet: MBAP header, function 1, address 0, one coil."""


def test_connections_are_bounded_and_come_free_again(line: Line) -> None:
    address = ("127.0.0.1", line.server.port)
    most = QUOTA.connections_per_address
    assert line.read(SPEED) == line.read(SPEED)
    many = [socket.create_connection(address, timeout=60) for _ in range(most - 1 + 8)]
    for one in many[:8]:  # they have sent no request, and make room
        one.settimeout(20)
        assert one.recv(1) == b""
    assert line.server.status().clients == most
    for one in many[8:]:
        one.sendall(READ_COIL)
        assert len(one.recv(100)) == 10
    with socket.create_connection(address, timeout=20) as late:
        assert late.recv(1) == b""  # all others are active
    for one in many:
        one.close()
    assert line.read(SPEED) == line.read(SPEED)
    with ModbusTcpClient("127.0.0.1", port=line.server.port, timeout=60) as another:
        assert not another.read_coils(0).isError()


def test_a_port_that_is_taken_is_said(line: Line) -> None:
    taken = line.server.port
    other = ModbusServer(line.source, list(line.rows.values()), port=taken)
    with ServerThread() as thread, pytest.raises(ServerError, match=f"modbus: 127.0.0.1:{taken} can't be listened on"):
        thread.run(other.start())


@controller
def test_the_first_to_write_holds_the_line_until_it_leaves(line: Line) -> None:
    assert not line.write(SETPOINT, 0.1).isError()
    with ModbusTcpClient("127.0.0.1", port=line.server.port, timeout=60) as another:
        address = line.rows[SETPOINT].address
        words = another.convert_to_registers(0.2, another.DATATYPE.FLOAT32)
        assert another.write_registers(address, words).exception_code == BUSY  # before the tick, too
        line.advance()
        assert another.write_registers(address, words).exception_code == BUSY
        assert line.simulation.line.modes.owner == f"modbus 127.0.0.1:{line.client.socket.getsockname()[1]}"
        line.simulation.take_outcomes()
        line.client.close()
        line.advance_until(lambda: not line.simulation.line.modes.owner, "its release")
        (given_up,) = line.simulation.take_outcomes()
        assert given_up.accepted and given_up.operation == DISOWN
        assert not another.write_registers(address, words).isError()
        line.advance()
        assert line.read_with(another, SETPOINT) == pytest.approx(0.2)


@controller
def test_who_is_silent_no_longer_holds_the_line(line: Line) -> None:
    """This is a cut cable: the connection does not end."""
    with socket.create_connection(("127.0.0.1", line.server.port), timeout=60) as silent:
        speed = struct.pack(">f", 0.1)
        silent.sendall(struct.pack(">HHHBBHHB", 1, 0, 11, 1, 16, line.rows[SETPOINT].address, 2, 4) + speed)
        assert silent.recv(64)[7] == 16
        line.advance()
        assert line.simulation.line.modes.owner
        line.lose_patience()
        line.advance_until(lambda: not line.simulation.line.modes.owner, "the end of its patience")
        assert not line.write(SETPOINT, 0.2).isError()


@controller
def test_a_release_waits_for_room(line: Line) -> None:
    while not line.write(SETPOINT, 0.1).isError():
        pass
    line.client.close()
    line.advance_until(lambda: not line.simulation.line.modes.owner, "its release")


@controller
def test_what_is_lost_is_not_read_as_if_it_were_there(line: Line) -> None:
    """All requests get exception 11 until the line is back."""
    header = Header(1, 1, "world")

    def hear(topic: str, data: bytes) -> None:
        view.take(topic, typestore().deserialize_cdr(data, TOPICS[topic].type))

    class Source(LineMirror):
        """Tag provider that records inputs."""

        controls = frozenset[Control]()
        give, control = line.source.give, line.source.control

    view = Source()
    hear("line", line_message(line.simulation, "a run", header))
    hear("signals", TOPICS["signals"].pack(line.simulation.line.signals(), header))
    server = ModbusServer(view, list(line.rows.values()), "controller")
    with ServerThread() as thread:
        thread.run(server.start())
        with ModbusTcpClient("127.0.0.1", port=server.port, timeout=60) as client:
            speed = line.rows[SPEED].address
            assert client.read_input_registers(speed, count=2).exception_code == NO_RESPONSE
            view.show()
            assert not client.read_input_registers(speed, count=2).isError()
            view.lose("the cable is cut")
            assert client.read_input_registers(speed, count=2).exception_code == NO_RESPONSE
            assert client.read_coils(0).exception_code == NO_RESPONSE
            words = client.convert_to_registers(0.1, client.DATATYPE.FLOAT32)
            assert client.write_registers(line.rows[SETPOINT].address, words).exception_code == NO_RESPONSE
            view.show()
            assert not client.write_registers(line.rows[SETPOINT].address, words).isError()
        thread.run(server.stop())


@controller
def test_three_clients_that_write_as_fast_as_they_can_hold_up_nobody(line: Line) -> None:
    """One of them holds the line. All are answered, the line goes on, and a fourth one reads."""
    stop, counts = threading.Event(), Counter[int]()

    def flood() -> None:
        with ModbusTcpClient("127.0.0.1", port=line.server.port, timeout=60) as client:
            words = client.convert_to_registers(0.1, client.DATATYPE.FLOAT32)
            while not stop.is_set():
                answer = client.write_registers(line.rows[SETPOINT].address, words)
                counts[answer.exception_code if answer.isError() else 0] += 1

    floods = [threading.Thread(target=flood) for _ in range(3)]
    for one in floods:
        one.start()
    for _ in range(50):
        line.advance()
        assert line.read(SPEED) >= 0.0
        assert len(line.simulation.take_outcomes()) <= MOST_WAITING
    stop.set()
    for one in floods:
        one.join(60.0)
    assert counts.keys() == {0, BUSY}
    status = line.server.status()
    assert status.writes == counts[0] and status.refused == counts[BUSY]


def test_who_asks_and_never_reads_is_cut_off(line: Line) -> None:
    """Its answers would be kept for ever."""
    ask = struct.pack(">HHHBBHH", 1, 0, 6, 1, 4, 0, 100)
    with socket.socket() as greedy:
        greedy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        greedy.settimeout(60)
        greedy.connect(("127.0.0.1", line.server.port))
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            while True:
                greedy.sendall(ask)
                time.sleep(0.001)
    assert line.read(SPEED) >= 0.0


def test_who_is_connected_and_silent_makes_room(line: Line) -> None:
    address = ("127.0.0.1", line.server.port)
    silent = [socket.create_connection(address, timeout=60) for _ in range(QUOTA.connections_per_address - 1)]
    for one in silent:
        one.sendall(READ_COIL)
        assert len(one.recv(100)) == 10
    line.lose_patience()
    time.sleep(2 * SHORT)
    with ModbusTcpClient(*address[:1], port=address[1], timeout=60) as another:
        assert not another.read_coils(0).isError()
    for one in silent:
        one.close()


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll is not installed: apt-get install mbpoll")
@controller
def test_mbpoll_reads_and_writes(line: Line) -> None:
    """An implementation in C (libmodbus). Its -B has the high word first."""
    port = str(line.server.port)
    row = line.rows[SETPOINT]
    common = ["mbpoll", "-0", "-B", "-p", port, "-t", "4:float", "-r", str(row.address), "-1", "127.0.0.1"]
    subprocess.run([*common, "0.125"], check=True, capture_output=True, timeout=60)
    line.advance(300)
    read = subprocess.run(common, check=True, capture_output=True, text=True, timeout=60).stdout
    assert "0.125" in read.split("--")[-1]
    assert line.read(SPEED) == pytest.approx(0.125)
    refused = subprocess.run([*common, "99"], capture_output=True, text=True, timeout=60)
    assert "Illegal data value" in refused.stderr


def test_a_mode_that_is_not_for_the_role_gets_an_exception(line: Line) -> None:
    """And is on record; of one request all is refused."""
    first, second = line.rows["belts/zone1/set_mode"], line.rows["belts/zone2/set_mode"]
    assert second.address == first.address + 1
    before = line.server.status()
    for modes in ([2], [3, 2], [9], [0]):
        assert line.client.write_registers(first.address, modes).exception_code == ILLEGAL_VALUE
    assert line.client.write_register(first.address, 2).exception_code == ILLEGAL_VALUE
    after = line.server.status()
    assert (after.writes - before.writes, after.refused - before.refused) == (0, 5)
    line.advance()
    assert [one.accepted for one in line.simulation.take_outcomes()] == [False] * 5
    assert line.read("belts/zone1/set_mode") == line.read("belts/zone2/set_mode") == 1


@controller
def test_a_controller_sets_no_modes(line: Line) -> None:
    address = line.rows["belts/zone1/set_mode"].address
    assert line.client.write_register(address, 3).exception_code == ILLEGAL_FUNCTION
    line.advance()
    assert line.simulation.take_outcomes() == []

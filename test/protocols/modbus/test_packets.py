# SPDX-License-Identifier: Apache-2.0
"""Packets of Modbus clients: each is answered by the standard, or ends the connection."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from contextlib import suppress

import pytest
from protocols.modbus.modbus_line import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    SETPOINT,
    SPEED,
    Line,
    serving,
)

from conveyor_sim.protocols.modbus.server import MOST_UNANSWERED


@pytest.fixture
def line() -> Iterator[Line]:
    """Serve the zoned line to clients that write as a controller."""
    with serving("controller") as found:
        yield found


def ask(line: Line, requests: bytes, count: int = 1) -> list[tuple[int, bytes]]:
    """Return transaction, and function with data, of `count` answers to bytes that are sent at once."""
    with socket.create_connection(("127.0.0.1", line.server.port), timeout=60) as raw, raw.makefile("rb") as answers:
        raw.sendall(requests)
        found = []
        for _ in range(count):
            transaction, protocol, length, unit = struct.unpack(">HHHB", answers.read(7))
            assert (protocol, unit) == (0, 1)
            found.append((transaction, answers.read(length - 1)))
        return found


def request(body: bytes, transaction: int = 1) -> bytes:
    """Return function and data as a packet."""
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, 1) + body


def test_requests_that_come_together_are_answered_in_their_order(line: Line) -> None:
    """More of them than are read at once."""
    count = 4 * MOST_UNANSWERED // 12
    asked = b"".join(request(b"\x04\xff\xfe\x00\x02", transaction) for transaction in range(count))
    assert ask(line, asked, count) == [(transaction, b"\x04\x04\0\0\0\0") for transaction in range(count)]
    half = request(b"\x04\xff\xfe\x00\x02", 7)
    with socket.create_connection(("127.0.0.1", line.server.port), timeout=60) as raw:
        for byte in half:
            raw.sendall(bytes([byte]))
        assert raw.recv(100)[:2] == half[:2]


def test_a_single_write_is_answered_by_what_was_asked(line: Line) -> None:
    """The standard requires it, although the value acts at the next tick: clients compare."""
    run, command = line.rows["belts/zone1/reverse"], line.rows["machines/filler/cntrl_cmd"]
    coil = struct.pack(">BHH", 5, run.address, 0xFF00)
    register = struct.pack(">BHH", 6, command.address, 3)
    assert line.read(run.name) == line.read(command.name) == 0.0
    assert [body for _, body in ask(line, request(coil) + request(register), 2)] == [coil, register]
    line.advance()
    assert (line.read(run.name), line.read(command.name)) == (1.0, 3.0)


MALFORMED = {
    "no registers": (b"\x04\0\0\0\0", ILLEGAL_VALUE),
    "too many registers": (b"\x03\0\0\0\x7e", ILLEGAL_VALUE),
    "too many bits": (b"\x02\0\0\x07\xd1", ILLEGAL_VALUE),
    "half a request": (b"\x04\0\0", ILLEGAL_VALUE),
    "fewer words than it says": (b"\x10\0\0\0\x02\x04\0\0", ILLEGAL_VALUE),
    "a coil that is neither on nor off": (b"\x05\0\0\x12\x34", ILLEGAL_VALUE),
    "a function alone": (b"\x10", ILLEGAL_VALUE),
    "beyond the last address": (b"\x04\xff\xff\0\x02", ILLEGAL_ADDRESS),
    "identification": (b"\x2b\x0e\x01\0", ILLEGAL_FUNCTION),
    "diagnostics": (b"\x08\0\x01\0\0", ILLEGAL_FUNCTION),
    "no function": (b"\x00\0", ILLEGAL_FUNCTION),
}


def test_a_request_that_can_not_be_is_refused_under_its_function(line: Line) -> None:
    asked = b"".join(request(body) for body, _ in MALFORMED.values())
    told = [body for _, body in ask(line, asked, len(MALFORMED))]
    expected = [bytes([body[0] | 0x80, code]) for body, code in MALFORMED.values()]
    assert dict(zip(MALFORMED, told, strict=True)) == dict(zip(MALFORMED, expected, strict=True))


@pytest.mark.parametrize("header", [b"\0\x01\0\x07\0\x06\x01", b"\0\x01\0\0\xff\xff\x01", b"\0\x01\0\0\0\x01\x01"])
def test_what_is_no_modbus_ends_its_connection(line: Line, header: bytes) -> None:
    """Another protocol, a length that can't be: where the next request begins can't be known."""
    with socket.create_connection(("127.0.0.1", line.server.port), timeout=60) as raw:
        raw.sendall(header)
        with suppress(ConnectionResetError):
            assert raw.recv(1) == b""
    assert line.read(SPEED) >= 0.0


def test_packets_that_are_none_end_nothing(line: Line) -> None:
    """Wrong lengths, wrong protocol, half a packet, a megabyte of noise: the next client is served all the same."""
    noise = [
        b"\x00",
        b"\x00\x01\x00\x00\x00\x06\x01\x03\x00\x00",
        b"\x00\x01\x00\x00\xff\xff\x01\x03\x00\x00\x00\x01",
        b"\x00\x01\x00\x07\x00\x06\x01\x03\x00\x00\x00\x01",
        struct.pack(">HHHBBHHB", 1, 0, 7, 1, 16, 0, 2, 4),
        bytes(range(256)) * 4096,
        b"GET / HTTP/1.1\r\n\r\n",
    ]
    for packet in noise:
        raw = socket.create_connection(("127.0.0.1", line.server.port), timeout=60)
        with raw, suppress(ConnectionResetError, BrokenPipeError):  # it is cut off
            raw.sendall(packet)
    assert not line.write(SETPOINT, 0.1).isError()
    line.advance()
    assert [outcome.names for outcome in line.simulation.take_outcomes()] == [(), (SETPOINT,)]

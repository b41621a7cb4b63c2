# SPDX-License-Identifier: Apache-2.0
"""Messages that would cost far more memory or time than they have bytes."""

from __future__ import annotations

import socket
import struct
from typing import TYPE_CHECKING

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer, NotEnoughData, ServiceError
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary, variant_from_binary, variant_to_binary

from conveyor_sim.protocols.opcua.limits import LIMITS
from conveyor_sim.protocols.opcua.processor import Allowance, BoundedBuffer
from test.protocols.opcua.conftest import PATIENCE

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line

Codes = ua.StatusCodes

ARRAY, DIMENSIONS = 0x80, 0x40
BOOLEAN, INT32, STRING, EXTENSION, DATA_VALUE, VARIANT = 1, 6, 12, 22, 23, 24


def array(kind: int, count: int, elements: bytes = b"") -> bytes:
    """Return a variant that announces an array."""
    return bytes([ARRAY | kind]) + struct.pack("<i", count) + elements


COSTLY = {
    "array of nothing": array(0, 2**31 - 1),
    "array of nothing with dimensions": bytes([ARRAY | DIMENSIONS]) + struct.pack("<i", 2**31 - 1),
    "null variants": array(VARIANT, 60_000, bytes(60_000)),
    "null values": array(DATA_VALUE, 60_000, bytes(60_000)),
    "null objects": array(EXTENSION, 20_000, bytes(60_000)),
    "empty strings": array(STRING, 15_000, b"\xff" * 60_000),
    "booleans": array(BOOLEAN, 60_000, bytes(60_000)),
    "numbers": array(INT32, 15_000, bytes(60_000)),
    "nested variants": bytes([VARIANT]) * 60_000 + b"\0",
    "nested arrays": array(VARIANT, 1) * 12_000 + b"\0",
    "many dimensions": bytes([ARRAY | DIMENSIONS | INT32])
    + struct.pack("<ii", 1, 0)
    + struct.pack("<i", 14_000)
    + struct.pack("<i", 1) * 14_000,
    "arrays of nothing": array(VARIANT, 5000, array(0, 1000) * 5000),
}


@pytest.mark.parametrize("name", COSTLY)
def test_costly_values_are_refused_while_they_are_decoded(name: str) -> None:
    allowance = Allowance(1000, 1000, 16_384)
    with pytest.raises((ServiceError, RecursionError)):
        variant_from_binary(BoundedBuffer(COSTLY[name], allowance))
    assert allowance.used <= 2000 + 1


@pytest.mark.parametrize("length", [-2, -4, -2147483648])
def test_negative_lengths_do_not_step_back(length: int) -> None:
    """The library would read the same bytes again: as many strings as the array announces, from eight bytes."""
    with pytest.raises(NotEnoughData):
        variant_from_binary(BoundedBuffer(array(STRING, 10**6, struct.pack("<i", length)), Allowance(100, 100, 100)))


@pytest.mark.parametrize(
    "value",
    [
        ua.Variant(list(range(1000)), ua.VariantType.Int64),
        ua.Variant(list(range(1000)), ua.VariantType.UInt16),
        ua.Variant([1.5] * 1000, ua.VariantType.Float),
        ua.Variant("x" * 1000),
        ua.Variant(b"x" * 1000),
        ua.Variant(b"\x80", ua.VariantType.ByteString),
        ua.Variant([None] * 100, ua.VariantType.Null, is_array=True),
        ua.Variant(["a"] * 100),
        ua.Variant([1, 2, 3, 4, 5, 6], ua.VariantType.Int32, [2, 3]),
    ],
    ids=str,
)
def test_values_within_the_limits_are_as_the_library_decodes_them(value: ua.Variant) -> None:
    data = variant_to_binary(value)
    bounded = variant_from_binary(BoundedBuffer(data, Allowance(1000, 1000, 1000)))
    assert bounded == variant_from_binary(Buffer(data))


@pytest.mark.parametrize(
    ("value", "limit"),
    [
        (ua.Variant([0] * 1001, ua.VariantType.Int64), "array_length"),
        (ua.Variant([0] * 1001, ua.VariantType.UInt16), "array_length"),
        (ua.Variant("x" * 1001), "string_bytes"),
        (ua.Variant(b"x" * 1001), "string_bytes"),
    ],
    ids=["Int64", "UInt16", "String", "ByteString"],
)
def test_one_element_or_byte_more_is_refused(value: ua.Variant, limit: str) -> None:
    allowance = Allowance(10_000, 1000, 1000)
    with pytest.raises(ServiceError) as caught:
        variant_from_binary(BoundedBuffer(variant_to_binary(value), allowance))
    assert caught.value.code == Codes.BadEncodingLimitsExceeded and allowance.exceeded, limit


def test_the_largest_requests_are_decoded() -> None:
    """Each request has the greatest number of operations, with names as long as on a line."""
    node = ua.NodeId("machines/a_rather_long_name_of_a_machine/produced", 2)
    read = ua.ReadParameters(NodesToRead=[ua.ReadValueId(node, ua.AttributeIds.Value)] * LIMITS.nodes_per_read)
    item = ua.MonitoredItemCreateRequest(ua.ReadValueId(node, ua.AttributeIds.Value))
    item.RequestedParameters.Filter = ua.DataChangeFilter()
    items = ua.CreateMonitoredItemsParameters(ItemsToCreate=[item] * LIMITS.items_per_call)
    clause = ua.SimpleAttributeOperand(ua.NodeId(2041), [ua.QualifiedName("ActiveState"), ua.QualifiedName("Id")])
    clause.AttributeId = ua.AttributeIds.Value
    event = ua.MonitoredItemCreateRequest(ua.ReadValueId(node, ua.AttributeIds.EventNotifier))
    event.RequestedParameters.Filter = ua.EventFilter(SelectClauses=[clause] * LIMITS.select_clauses)
    events = ua.CreateMonitoredItemsParameters(ItemsToCreate=[event] * 8)
    allowance = Allowance(LIMITS.decoding_steps, LIMITS.array_length, LIMITS.string_bytes)
    for request in (read, items, events):
        allowance.used = 0
        data = struct_to_binary(request)
        assert len(data) < LIMITS.message_bytes
        struct_from_binary(type(request), BoundedBuffer(data, allowance))


class Raw:
    """Client that sends bytes over a channel without security."""

    def __init__(self, line: Line) -> None:
        self.socket = socket.create_connection(("127.0.0.1", line.server.port), timeout=PATIENCE)
        self.socket.sendall(hello(65_535))
        assert self.receive()[:3] == b"ACK"
        request = ua.OpenSecureChannelRequest()
        request.Parameters.SecurityMode = ua.MessageSecurityMode.None_
        request.Parameters.RequestedLifetime = 3_600_000
        policy = b"http://opcfoundation.org/UA/SecurityPolicy#None"
        body = struct.pack("<Ii", 0, len(policy)) + policy + struct.pack("<iiII", -1, -1, 1, 1)
        body += struct_to_binary(request)
        self.socket.sendall(b"OPNF" + struct.pack("<I", len(body) + 8) + body)
        answer = self.receive()
        (self.channel,) = struct.unpack_from("<I", answer, 8)
        response = struct_from_binary(ua.OpenSecureChannelResponse, Buffer(answer[answer.index(b"#None") + 21 :]))
        self.token = response.Parameters.SecurityToken.TokenId
        self._number = 1

    def receive(self) -> bytes:
        """Return one message, or the bytes before the connection ends."""
        answer = b""
        try:
            while len(answer) < 8 or len(answer) < struct.unpack_from("<I", answer, 4)[0]:
                if not (part := self.socket.recv(65_536)):
                    break
                answer += part
        except ConnectionError:
            pass
        return answer

    def send(self, body: bytes, chunk: bytes = b"F", part: int = 60_000) -> None:
        """Send a message in parts."""
        for first in range(0, len(body), part):
            self._number += 1
            last = first + part >= len(body)
            head = struct.pack("<IIII", self.channel, self.token, self._number, 2) + body[first : first + part]
            self.socket.sendall(b"MSG" + (chunk if last else b"C") + struct.pack("<I", len(head) + 8) + head)


def hello(size: int) -> bytes:
    return struct.pack("<3scIIIIIIi", b"HEL", b"F", 32, 0, size, size, 0, 0, -1)


def endpoints(additional: bytes) -> bytes:
    """Return a GetEndpoints request whose header carries an operand of filters with a value."""
    request = struct_to_binary(ua.GetEndpointsRequest())
    header = b"\0\0" + struct.pack("<qIIiI", 0, 1, 0, -1, 0)
    operand = b"\x01\x00" + struct.pack("<HBi", 597, 1, len(additional)) + additional
    return request[:4] + header + operand + struct.pack("<iii", -1, -1, -1)


@pytest.mark.parametrize("name", [*COSTLY, "string that steps back"])
def test_before_a_session_costly_values_end_the_connection(line: Line, name: str) -> None:
    value = COSTLY.get(name, array(STRING, 10**6, struct.pack("<i", -4)))
    client = Raw(line)
    client.send(endpoints(value))
    answer = client.receive()
    assert answer[:3] == b"ERR"
    if name in COSTLY:
        assert struct.unpack_from("<I", answer, 8)[0] == Codes.BadEncodingLimitsExceeded
    assert client.socket.recv(1) == b""


@pytest.mark.parametrize("part", [60_000, 1000], ids=["large parts", "many parts"])
def test_before_a_session_messages_are_small(line: Line, part: int) -> None:
    client = Raw(line)
    try:
        client.send(bytes(LIMITS.message_bytes_before_login + 1), part=part)
    except ConnectionError:
        return  # the server closed while this was sent
    answer = client.receive()
    assert answer == b"" or struct.unpack_from("<3s5xI", answer) == (b"ERR", Codes.BadTcpMessageTooLarge)


def test_parts_of_a_message_that_never_ends_are_not_kept(line: Line) -> None:
    client = Raw(line)
    with pytest.raises(ConnectionError):
        for _ in range(10_000):
            client.send(b"x", chunk=b"C")
            client.socket.setblocking(False)
            try:
                if client.socket.recv(1000)[:3] == b"ERR":
                    raise ConnectionResetError
            except BlockingIOError:
                pass
            client.socket.setblocking(True)


def test_answers_are_not_cut_into_tiny_parts(line: Line) -> None:
    with socket.create_connection(("127.0.0.1", line.server.port), timeout=PATIENCE) as client:
        client.sendall(hello(100))
        answer = client.recv(1000)
    assert struct.unpack_from("<3s5xI", answer) == (b"ERR", Codes.BadConnectionRejected)


def test_a_request_before_a_session_is_answered(line: Line) -> None:
    client = Raw(line)
    client.send(endpoints(array(STRING, 3, b"\xff" * 12)))
    answer = client.receive()
    assert answer[:3] == b"MSG" and b"opc.tcp://" in answer
    client.socket.close()

# SPDX-License-Identifier: Apache-2.0
"""Clients that misbehave: each is refused, others are still served, and memory is bounded."""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from typing import TYPE_CHECKING, Any

import pytest
from asyncua import Client as AsyncClient
from asyncua import ua
from protocols.waiting import alone

from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.opcua import session, transport
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.processor import CHUNK
from conveyor_sim.protocols.opcua.server import OpcUaServer
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.server.quotas import QUOTA
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING
from test.protocols.opcua.conftest import PASSWORD, PATIENCE

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line, Serve

SETPOINT = "belts/zone1/cmd_speed"
HELLO = struct.pack("<3scIIIIII", b"HEL", b"F", 32, 0, 65535, 65535, 0, 0) + struct.pack("<i", -1)


def raw(line: Line) -> socket.socket:
    return socket.create_connection(("127.0.0.1", line.server.port), timeout=PATIENCE)


def closed(connection: socket.socket) -> bytes:
    """Return the answer before the server closes the connection."""
    answer = b""
    try:
        while came := connection.recv(65536):
            answer += came
    except ConnectionResetError:
        pass
    return answer


PACKETS = {
    "http": b"GET / HTTP/1.1\r\n\r\n",
    "zeros": b"\x00" * 8,
    "empty": struct.pack("<3scI", b"HEL", b"F", 8),
    "short": struct.pack("<3scI", b"MSG", b"F", 4),
    "long string": HELLO[:28] + struct.pack("<i", 2**30),
    "noise": struct.pack("<3scII", b"OPN", b"F", 200, 0) + bytes(range(188)),
    "no channel": struct.pack("<3scII", b"MSG", b"F", 100, 77) + bytes(88),
    "unknown": struct.pack("<3scII", b"XYZ", b"F", 100, 0) + bytes(88),
}


def test_packets_that_are_none_are_answered_by_the_end_of_the_connection(line: Line) -> None:
    for name, packet in PACKETS.items():
        with raw(line) as connection:
            connection.sendall(packet)
            connection.shutdown(socket.SHUT_WR)
            answer = closed(connection)
        assert answer == b"" or answer[:3] == b"ERR", name
    line.client()
    line.advance()


@pytest.mark.parametrize("packet", [PACKETS["http"], struct.pack("<3scI", b"HEL", b"F", 2**32 - 1)])
def test_a_length_that_can_not_be_is_refused_at_once(line: Line, packet: bytes) -> None:
    with raw(line) as connection:
        connection.sendall(packet)
        answer = closed(connection)
    assert struct.unpack_from("<3s5xI", answer) == (b"ERR", ua.StatusCodes.BadTcpMessageTooLarge)


def test_a_message_without_end_is_not_kept(line: Line) -> None:
    """Its header says four gigabytes."""
    with raw(line) as connection:
        connection.sendall(struct.pack("<3scII", b"MSG", b"F", 2**32 - 1, 0))
        sent = 0
        try:
            for _ in range(1000):
                sent += connection.send(bytes(CHUNK))
        except (BrokenPipeError, ConnectionResetError):
            pass
        assert sent < 1000 * CHUNK
    line.advance()


def test_connections_are_bounded_and_come_free_again(line: Line) -> None:
    """The first ones make room: none of them has got further than the others."""
    most = QUOTA.connections_per_address
    many = [raw(line) for _ in range(most + 8)]
    assert all(closed(one)[:3] == b"ERR" for one in many[:8])
    line.until(lambda: line.server.status().clients == most)
    for one in many:
        one.close()
    line.until(lambda: line.server.status().clients == 0)
    assert line.client().get_node(f"ns=2;s={SETPOINT}").read_value() is not None


def test_who_begins_no_session_is_not_waited_for(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "ACTIVATION", 0.2)
    others = line.server.status().clients
    with raw(line) as silent, raw(line) as half:
        half.sendall(HELLO)
        assert closed(silent) == b"" and closed(half)[:3] == b"ACK"
    line.until(lambda: line.server.status().clients == others)


def test_one_connection_begins_one_session(line: Line) -> None:
    """The library would keep each for ever."""

    async def come() -> int:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        async with client:
            before = len(sessions())
            for _ in range(5):
                with pytest.raises(ua.UaStatusCodeError):
                    await client.create_session()
            return len(sessions()) - before

    def sessions() -> dict[object, object]:
        found: dict[object, object] = line.server._server.iserver._external_sessions  # type: ignore[union-attr]
        return found

    assert alone(come()) == 0


def test_long_strings_are_refused(line: Line) -> None:

    async def write(length: int) -> None:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        client.set_user("controller")
        client.set_password(PASSWORD)
        async with client:
            await client.get_node(f"ns=2;s={SETPOINT}").write_value("x" * length)

    for length in (100_000, 10_000_000):
        with pytest.raises((ua.UaError, ConnectionError)):
            alone(write(length))
    line.client()
    line.advance()
    assert line.outcomes() == []


def test_subscriptions_of_a_client_that_is_gone_are_not_kept(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    """This holds whether the line changes or not; a connected client keeps its subscriptions."""
    monkeypatch.setattr(session, "UNFETCHED", 4.0)  # as long as a busy machine may forget a client that is there

    async def come_and_vanish() -> None:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        await client.connect()
        subscription = await client.create_subscription(100, _Deaf())
        await subscription.subscribe_data_change(client.get_node(f"ns=2;s={SETPOINT}"))
        client.uaclient.protocol.transport.abort()

    there = line.client().create_subscription(100, _Deaf())
    there.subscribe_data_change(line.node(SETPOINT))
    alone(come_and_vanish())
    line.until(lambda: line.server.status().monitored_items == 1)
    line.advance(3)
    time.sleep(6.0)  # longer than an unfetched one lives
    assert line.server.status().monitored_items == 1


class _Deaf:
    def datachange_notification(self, *_: Any) -> None:
        """Ignore a notification."""


def test_three_clients_that_write_as_fast_as_they_can(line: Line) -> None:
    """They fill what waits, are refused the rest, and the line goes on with what was taken."""

    async def flood() -> list[int]:
        async def write(client: AsyncClient) -> list[int]:
            value = ua.WriteValue(
                ua.NodeId(SETPOINT, 2),
                ua.AttributeIds.Value,
                None,
                ua.DataValue(ua.Variant(0.1, ua.VariantType.Double)),
            )
            params = ua.WriteParameters([value])
            return [code.value for _ in range(500) for code in await client.uaclient.session.write(params)]

        clients = []
        for _ in range(3):
            client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
            client.set_user("controller")
            client.set_password(PASSWORD)
            await client.connect()
            clients.append(client)
        codes = await asyncio.gather(*(write(client) for client in clients))
        for client in clients:
            await client.disconnect()
        return [code for each in codes for code in each]

    before = line.server.status()
    codes = alone(flood())
    assert codes.count(ua.StatusCodes.GoodCompletesAsynchronously) == MOST_WAITING
    assert codes.count(ua.StatusCodes.BadTooManyOperations) == 3 * 500 - MOST_WAITING
    line.advance()
    assert len(line.outcomes()) == MOST_WAITING
    after = line.server.status()
    counted = (after.writes - before.writes, after.refused - before.refused)
    assert counted == (MOST_WAITING, 3 * 500 - MOST_WAITING)


def test_a_subscription_can_not_be_faster_than_the_server(line: Line) -> None:
    line.client().create_subscription(0, None)
    found = line.server._server.iserver.subscription_service.subscriptions  # type: ignore[union-attr]
    assert [each.data.RevisedPublishingInterval for each in found.values()] == [10.0]


def test_a_port_that_is_taken_is_said(line: Line, certificates: Path) -> None:
    port = line.server.port
    other = OpcUaServer(line.source, certificates=certificates, port=port)
    with ServerThread() as thread, pytest.raises(ServerError, match=f"opcua: 127.0.0.1:{port} can't be listened on"):
        thread.run(other.start())


def test_a_server_that_is_started_again_is_found_where_it_was(serve: Serve, certificates: Path) -> None:
    line = serve()
    port = line.server.port
    line.client()
    line.leave()
    line.thread.run(line.server.stop())
    line.server = OpcUaServer(line.source, certificates=certificates, port=port)
    line.thread.run(line.server.start())
    line.advance()
    assert line.server.port == port and line.read(SETPOINT) == line.source.snapshot.values[SETPOINT]


def test_what_waits_for_a_client_is_bounded(serve: Serve) -> None:
    """The library takes a queue of 0 for one without end; of guests a quarter of all queues is kept free."""
    line = serve(limits=OpcUaLimits(queue_size=60, queued=120))
    subscription = line.client().create_subscription(60_000, None)
    node = line.node("run/tick")

    def found() -> list[Any]:
        service = line.server._server.iserver.subscription_service  # type: ignore[union-attr]
        (only,) = service.subscriptions.values()
        return list(only.monitored_item_srv._monitored_items.values())

    def sizes() -> list[int]:
        return [item.queue_size for item in found()]

    first = subscription.subscribe_data_change(node, queuesize=10**6)
    subscription.subscribe_data_change(node, queuesize=0)
    assert sizes() == [60, 1]
    subscription.tloop.post(subscription.aio_obj.modify_monitored_item(first, 100.0, 0))
    assert sizes() == [1, 1]
    for expected in (40, 40, 8, 1):
        subscription.subscribe_data_change(node, queuesize=40)
        assert sizes()[-1] == expected
    for _ in range(30):
        line.advance()
    service = line.server._server.iserver.subscription_service  # type: ignore[union-attr]
    (only,) = service.subscriptions.values()
    assert sum(map(len, only._triggered_datachanges.values())) <= 91

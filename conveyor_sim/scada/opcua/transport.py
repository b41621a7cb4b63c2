"""Connections of OPC UA clients: bounded in what they may send, and closed with the reason when it makes no sense."""

from __future__ import annotations

import asyncio
import socket
import time
from contextvars import ContextVar
from typing import Any

from asyncua import Server, ua
from asyncua.common.connection import TransportLimits
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.ua.ua_binary import uatcp_to_binary

from conveyor_sim.scada.opcua.dispatch import Dispatcher

MOST_CLIENTS = 64
"""Connections at once; one more is closed at once."""

CHUNK, MESSAGE = 65_535, 4_000_000
"""Bytes of a part of a message, and of a whole one, at most."""

ACTIVATION = 30.0
"""s that a connection has for beginning a session, and may stay without one."""

_SIZE = slice(4, 8)
"""Bytes of a message that say how long it is (OPC 10000-6, 7.1.2.2)."""

_WAITING = 200
"""Messages of a connection that wait to be answered."""


def limits() -> TransportLimits:
    """Of all connections."""
    return TransportLimits(CHUNK, CHUNK, MESSAGE // CHUNK + 1, MESSAGE)


class Connection(OPCUAProtocol):
    """One of them."""

    longest: list[float]
    """One element, for all connections: s of wall time from a message to its being done with, the longest."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.transport is not None:
            self.processor = Dispatcher(self.iserver, self.transport, self.limits)
            self.processor.set_policies(self.policies)
        if self.transport is not None and (connection := transport.get_extra_info("socket")) is not None:
            # A client that is gone without a word is noticed.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)

    @property
    def has_session(self) -> bool:
        """Whether a client has begun a session here that has not ended."""
        session = self.processor.session if self.processor else None
        return session is not None and session.state.name != "Closed"

    @property
    def origin(self) -> str:
        """Address of the client's machine."""
        peer = None if self.transport is None else self.transport.get_extra_info("peername")
        return str(peer[0]) if peer else ""

    @property
    def encrypts(self) -> bool:
        """Whether what comes here can't be read on the way."""
        policy = self.processor._connection.security_policy if self.processor else None
        return policy is not None and policy.Mode == ua.MessageSecurityMode.SignAndEncrypt

    @property
    def peer(self) -> bytes | None:
        """Certificate of the client, which has proved that it is its own; None: the channel is not secured."""
        policy = self.processor._connection.security_policy if self.processor else None
        return policy.peer_certificate if policy is not None and policy.Mode != ua.MessageSecurityMode.None_ else None

    def leave(self) -> None:
        """Have nothing more to do with the session."""
        if self.processor is not None:
            self.processor.session = None

    def data_received(self, data: bytes) -> None:
        """What has come so far of a message is kept by the library, whatever its length, and waited for."""
        if self.transport is None or self.transport.is_closing():
            return
        super().data_received(data)
        said = int.from_bytes(self._buffer[_SIZE], "little") if len(self._buffer) >= _SIZE.stop else 0
        if max(said, len(self._buffer)) > CHUNK:
            self._refuse(ua.StatusCodes.BadTcpMessageTooLarge, "")

    async def _activation_watchdog(self) -> None:
        """Not only at first: a session may time out, and its connection stay."""
        while True:
            await asyncio.sleep(ACTIVATION)
            session = self.processor.session if self.processor else None
            if session is None or not session.is_activated():
                self.transport.close()
                return

    async def _process_one_msg(self, header: Any, buf: Any) -> bool:
        """The library leaves a client without an answer whose message it can't make out."""
        channel.set(self)
        began = time.perf_counter()
        try:
            return await super()._process_one_msg(header, buf)
        except Exception as error:
            code = getattr(error, "code", ua.StatusCodes.BadSecurityChecksFailed)
            self._refuse(code, str(error))
            return False
        finally:
            self.longest[0] = max(self.longest[0], time.perf_counter() - began)

    def _refuse(self, code: int, reason: str) -> None:
        self._buffer = b""
        if self.transport is not None and not self.transport.is_closing():
            message = ua.ErrorMessage(ua.StatusCode(code), reason[:200])
            self.transport.write(uatcp_to_binary(ua.MessageType.Error, message))
            self.transport.close()


channel: ContextVar[Connection | None] = ContextVar("channel", default=None)
"""The connection whose message is being answered."""


class _Port(BinaryServer):
    longest: list[float]

    def _make_protocol(self) -> OPCUAProtocol:
        made = Connection(self.iserver, self._policies, self.clients, self.closing_tasks, self.limits)
        made.longest = self.longest
        return made


class BoundedServer(Server):
    """The library's server, listening by connections of this kind."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.longest = [0.0]
        self.limits = limits()
        self.iserver.max_connections = MOST_CLIENTS
        self.iserver.max_pending_activation_seconds = ACTIVATION
        self.iserver.max_pending_messages_per_connection = _WAITING
        self.iserver.max_subscriptions = 4 * MOST_CLIENTS
        self.iserver.max_unacked_messages_per_subscription = 20

    async def listen(self, host: str, port: int) -> int:
        """Serve from now on; the port. Raises OSError."""
        await self._setup_server_nodes()
        await self.iserver.start()
        self.bserver = _Port(self.iserver, host, port, self.limits)
        self.bserver.longest = self.longest
        self.bserver.set_policies(self._policies)
        try:
            await self.bserver.start()
        except BaseException:
            await self.iserver.stop()
            raise
        return self.bserver.port

    async def stop(self) -> None:
        """The library waits for its clock, a second."""
        clock, self.iserver.time_task = self.iserver.time_task, None
        if clock is not None:
            clock.cancel()
        await super().stop()

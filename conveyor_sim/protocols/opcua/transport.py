# SPDX-License-Identifier: Apache-2.0
"""Connections of OPC UA clients, with bounded input. Malformed input ends them, with the reason."""

from __future__ import annotations

import asyncio
import socket
import time
from contextvars import ContextVar
from typing import Any

from asyncua import ua
from asyncua.common.utils import Buffer, ServiceError
from asyncua.server.binary_server_asyncio import OPCUAProtocol
from asyncua.ua.ua_binary import header_from_binary, uatcp_to_binary

from conveyor_sim.protocols.opcua.asyncua_internals import OpenPort, OpenProtocol, OpenServer
from conveyor_sim.protocols.opcua.client_certificates import without_issuers
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.processor import CHUNK, ConnectionLimits, Processor
from conveyor_sim.protocols.server.quotas import GREETED, OPENED, Budget, ConnectionSlot, ConnectionSlots

ACTIVATION = 30.0
"""Longest time that a connection may be without an active session, s."""

_SIZE = slice(4, 8)
"""Bytes of a message that hold its length (OPC 10000-6, 7.1.2.2)."""

_WAITING = 16
"""Largest number of unanswered messages of a connection; beyond it no more are read."""


class Connection(OpenProtocol):
    """Connection of one client."""

    longest: list[float]
    """Longest wall time from a message to its completion, s; one element, shared by all connections."""
    bounds: OpcUaLimits
    places: ConnectionSlots
    guests: Budget
    """Budget of all sessions without a user."""
    turn: asyncio.Lock
    """Lock held while a guest's request is answered, so that guests are served one at a time."""
    place: ConnectionSlot | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a slot for a new connection, or close the connection."""
        peer = transport.get_extra_info("peername")
        self.place = self.places.take(str(peer[0]) if peer else "", self._make_room)
        if self.place is None:
            transport.close()
            return
        super().connection_made(transport)
        if self.transport is None:
            return
        self._received = bytearray()
        rate = self.bounds.request_units_per_second
        self.work = Budget(rate, 2 * rate)
        self.processor = Processor(self.iserver, self.transport, self.bounds)
        self.processor.set_policies(self.policies)
        if (connection := transport.get_extra_info("socket")) is not None:
            # Detect clients that vanish without closing the connection.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)

    def connection_lost(self, ex: BaseException | None) -> None:
        """Free the slot of a closed connection."""
        if self.place is not None:
            self.places.leave(self.place)
        super().connection_lost(ex)

    @property
    def has_session(self) -> bool:
        """True if the connection has a session that is not closed."""
        session = self.processor.session if self.processor else None
        return session is not None and session.state.name != "Closed"

    @property
    def origin(self) -> str:
        """Address of the client's machine."""
        peer = None if self.transport is None else self.transport.get_extra_info("peername")
        return str(peer[0]) if peer else ""

    @property
    def encrypts(self) -> bool:
        """True if the channel is encrypted."""
        policy = self.processor.channel.security_policy if self.processor else None
        return policy is not None and policy.Mode == ua.MessageSecurityMode.SignAndEncrypt

    @property
    def peer(self) -> bytes | None:
        """Certificate of the client, which has proved that it owns the key; None: the channel is not secured."""
        policy = self.processor.channel.security_policy if self.processor else None
        if policy is None or policy.Mode == ua.MessageSecurityMode.None_:
            return None
        return without_issuers(policy.peer_certificate)

    def require_place(self, user: str) -> None:
        """End the connection and raise ServiceError if no slot is free for a session of `user` ("": a guest)."""
        if self.place is None:
            return
        if not (self.places.admit_user(self.place, user) if user else self.places.admit_guest(self.place)):
            self._end_session()
            self._refuse(ua.StatusCodes.BadTooManySessions, "")
            raise ServiceError(ua.StatusCodes.BadTooManySessions)

    def leave(self) -> None:
        """Detach the connection from its session."""
        if self.processor is not None:
            self.processor.session = None
        if self.place is not None:
            self.places.leave_user(self.place)

    def note_failure(self) -> None:
        """Record a failed login. Such connections are dropped first."""
        if self.place is not None:
            self.place.has_failed = True

    def data_received(self, data: bytes) -> None:
        """Collect messages. The library would copy all bytes of a packet for each message in it, without a bound."""
        if self.transport is None or self.transport.is_closing():
            return
        self._received += data
        self._take()

    def _take(self) -> None:
        """Pass complete messages on, unless too many wait."""
        if self.transport is None or self.transport.is_closing():
            return
        while len(self._received) >= _SIZE.stop and self.messages.qsize() < _WAITING:
            size = int.from_bytes(self._received[_SIZE], "little")
            if size > CHUNK:
                self._refuse(ua.StatusCodes.BadTcpMessageTooLarge, "")
                return
            if len(self._received) < size:
                break
            try:
                chunk = Buffer(bytes(self._received[: max(size, _SIZE.stop)]))
                header = header_from_binary(chunk)
                if header.body_size <= 0:
                    raise ValueError(f"{size} bytes announced, expected a message")
            except Exception as error:  # the library raises several kinds
                self._refuse(ua.StatusCodes.BadTcpMessageTypeInvalid, str(error))
                return
            del self._received[:size]
            self.messages.put_nowait((header, chunk))
        if self.messages.qsize() >= _WAITING:
            self.transport.pause_reading()
        else:
            self.transport.resume_reading()

    async def watch_activation(self) -> None:
        """Close connections without an active session, at any time. The library checks only once, but a session may
        time out.
        """
        while True:
            await asyncio.sleep(ACTIVATION)
            session = self.processor.session if self.processor else None
            if session is None or not session.is_activated():
                self._close()
                return

    async def answer_message(self, header: Any, buf: Any) -> bool:
        """Answer one message within the budgets. The library does not answer messages that it can't decode."""
        channel.set(self)
        await asyncio.sleep(self.work.delay())  # until the work of earlier messages is within the budget
        if not self._is_guest:
            return await self._answer(header, buf)
        async with self.turn:
            # One at a time, so that requests of users are answered between those of many waiting guests.
            await asyncio.sleep(self.guests.delay())
            return await self._answer(header, buf)

    async def _answer(self, header: Any, buf: Any) -> bool:
        if self.transport is None or self.transport.is_closing() or not isinstance(self.processor, Processor):
            return False
        before, began = self.processor.units, time.perf_counter()
        try:
            goes_on = await super().answer_message(header, buf)
        except Exception as error:
            code = getattr(error, "code", ua.StatusCodes.BadSecurityChecksFailed)
            self._refuse(code, str(error))
            return False
        finally:
            self.longest[0] = max(self.longest[0], time.perf_counter() - began)
            self._charge(self.processor.units - before)
        if self.place is not None:
            self.place.touch(OPENED if self.processor.channel.is_open() else GREETED)
            if not self.has_session:
                self.places.leave_user(self.place)
        self._take()
        return goes_on

    @property
    def _is_guest(self) -> bool:
        """True for an activated session without a user."""
        session = self.processor.session if self.processor else None
        return session is not None and session.is_activated() and not session.user.name

    def _charge(self, units: int) -> None:
        self.work.spend(units)
        if self._is_guest:
            self.guests.spend(units)

    def _make_room(self) -> None:
        """Close the connection and its session to make room for another connection."""
        self._end_session()
        self._refuse(ua.StatusCodes.BadTcpServerTooBusy, "another client needs the place")

    def _end_session(self) -> None:
        session = self.processor.session if self.processor else None
        if session is not None:
            self.closing_tasks.append(asyncio.create_task(session.close_session(True)))

    def _refuse(self, code: int, reason: str) -> None:
        self._received = bytearray()
        if self.transport is not None and not self.transport.is_closing():
            message = ua.ErrorMessage(ua.StatusCode(code), reason[:200])
            self.transport.write(uatcp_to_binary(ua.MessageType.Error, message))
            self._close()

    def _close(self) -> None:
        """Close the connection. Discard unread data of a client that does not read, because it may never do so."""
        if self.transport is None:
            return
        if self.transport.get_write_buffer_size():
            self.transport.abort()
        else:
            self.transport.close()


channel: ContextVar[Connection | None] = ContextVar("channel", default=None)
"""Connection whose message is being answered."""


class _Port(OpenPort):
    longest: list[float]
    bounds: OpcUaLimits
    places: ConnectionSlots
    guests: Budget
    turn: asyncio.Lock

    def make_protocol(self) -> OPCUAProtocol:
        made = Connection(self.iserver, self.policies, self.clients, self.closing_tasks, self.limits)
        made.longest, made.bounds, made.places = self.longest, self.bounds, self.places
        made.guests, made.turn = self.guests, self.turn
        return made


class BoundedServer(OpenServer):
    """Server of the library with bounded connections."""

    def __init__(self, internal: Any, bounds: OpcUaLimits, places: ConnectionSlots) -> None:
        """Prepare the server. bounds: limits of each client. places: slots of the connections."""
        super().__init__(iserver=internal)
        self.longest = [0.0]
        self.bounds, self.places = bounds, places
        self.limits = ConnectionLimits.of(bounds)
        # `places` limits connections. The library's limit would also count those that are being closed to make room.
        self.iserver.max_connections = 1_000_000
        self.iserver.max_pending_activation_seconds = ACTIVATION
        self.iserver.max_pending_messages_per_connection = 0  # `Connection` stops reading instead
        self.iserver.max_unacked_messages_per_subscription = 20

    async def listen(self, host: str, port: int) -> int:
        """Serve from now on. Return the port. Raises OSError."""
        await self.set_up_nodes()
        await self.iserver.start()
        rate = self.bounds.guest_units_per_second
        self.bserver = _Port(self.iserver, host, port, self.limits)
        self.bserver.longest, self.bserver.bounds, self.bserver.places = self.longest, self.bounds, self.places
        self.bserver.guests, self.bserver.turn = Budget(rate, 2 * rate), asyncio.Lock()
        self.bserver.set_policies(self.policies)
        try:
            await self.bserver.start()
        except BaseException:
            await self.iserver.stop()
            raise
        return self.bserver.port

    async def stop(self) -> None:
        """Stop the server, without waiting a second for the clock of the library."""
        clock, self.iserver.time_task = self.iserver.time_task, None
        if clock is not None:
            clock.cancel()
        await super().stop()

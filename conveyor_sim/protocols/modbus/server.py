# SPDX-License-Identifier: Apache-2.0
"""`ModbusServer`: a line as a Modbus TCP server, by the addresses of a map.

Modbus has no users. Every client that reaches the port can read. Writes are refused unless the server has a role for
them. Refusals are exceptions (Modbus Application Protocol 1.1b3, 7):

1: writes are not allowed, or the function is not supported.
2: the address is not in the map, or a value would be written in part.
3: a value is out of range, or the request is malformed.
6: the device is in another control mode or owned by another client, or too many inputs wait.
11, for reads as well: the connection to the line is lost, so values would be stale.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import time
from collections.abc import Mapping, Sequence
from contextvars import ContextVar
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from conveyor_sim.line.commands.authority import MAY
from conveyor_sim.line.commands.inputs import MODE, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Cause, Receipt
from conveyor_sim.line.tag import COMMANDS
from conveyor_sim.protocols.modbus.address_map import SET_MODE
from conveyor_sim.protocols.server.interface import HERE, ServerError, Status, require_free
from conveyor_sim.protocols.server.quotas import GUEST, QUOTA, ConnectionSlot, ConnectionSlots, Quota
from conveyor_sim.protocols.tags.control_mode import Holding, HoldingService, objection, refused_for_good
from conveyor_sim.protocols.tags.handshake import MAY_GO_ON, TARGET, TICK
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.tag_provider import MODBUS, TagProvider
from conveyor_sim.support.modbus_rows import Row, Table, decode, encode

MOST_UNREAD = 64 * 1024
"""Largest number of unread bytes of answers; beyond it the connection ends."""

MOST_UNANSWERED = 4096
"""Largest number of bytes of unanswered requests; beyond it no more are read from the connection."""

_HEADER = struct.Struct(">HHHB")  # MBAP: transaction, protocol, length from the unit on, unit
_ONE_COIL, _ONE_REGISTER = 5, 6  # functions
_ON_OR_OFF = (b"\xff\x00", b"\x00\x00")
_LENGTHS = range(2, 255)  # of unit, function and data (Modbus Messaging on TCP/IP 1.0b, 3.1.3 and 4.1)

_LOOK = 0.5  # wall time between two checks for silent holders, s
_KEEP_ALIVE = {socket.TCP_KEEPIDLE: 10, socket.TCP_KEEPINTVL: 5, socket.TCP_KEEPCNT: 3}  # s, s, 1

_TABLE_OF: dict[int, Table] = {
    **dict.fromkeys((1, 5, 15), "coil"),
    2: "discrete input",
    4: "input register",
    **dict.fromkeys((3, 6, 16, 22, 23), "holding register"),
}
"""Table by function code; other functions are not supported."""

_EXCEPTIONS: Mapping[Cause, ExcCodes] = {
    "operation": ExcCodes.ILLEGAL_FUNCTION,
    "role": ExcCodes.ILLEGAL_VALUE,
    "name": ExcCodes.ILLEGAL_ADDRESS,
    "value": ExcCodes.ILLEGAL_VALUE,
    "form": ExcCodes.ILLEGAL_VALUE,
}
"""Exception code of an input that no state of the line allows, by the cause of its refusal."""

_writer: ContextVar[str] = ContextVar("writer", default=MODBUS)
"""Writer whose request is being answered."""


class ModbusServer:
    """Protocol server for one tag provider, by Modbus TCP."""

    def __init__(
        self,
        source: TagProvider,
        rows: Sequence[Row],
        role: WriterKind | None = None,
        host: str = HERE,
        port: int = 0,
        quota: Quota = QUOTA,
        holding: HoldingService | None = None,
    ) -> None:
        """Prepare the server. rows: map of addresses. role: role in which clients write; None: they may not write.
        port: 0 for any free one.
        quota: limits of the connections; a client that is idle for longer than `quota.idle` no longer holds the line.
        holding: decides which client holds the line; None: a new one.
        """
        self._image = _Image(source, rows, role, holding or Holding(source, MODBUS))
        self._at = host, port
        self._quota = quota
        self._server: _Server | None = None
        self._watch: asyncio.Task[None] | None = None

    @property
    def port(self) -> int:
        """Port on which it listens. Raises RuntimeError before `start`."""
        if self._server is None or self._server.transport is None:
            raise RuntimeError("the server was not started")
        sockets: Any = self._server.transport
        return int(sockets.sockets[0].getsockname()[1])

    @property
    def address(self) -> str:
        """Address for clients."""
        host, port = self._at
        return f"modbus://{host}:{port if self._server is None else self.port}"

    def status(self) -> Status:
        """Return the number of open connections, and counts of accepted and refused write requests."""
        server, image = self._server, self._image
        if server is None:
            return Status(0, 0, image.writes, image.refused, 0.0)
        longest, server.longest = server.longest, 0.0
        return Status(len(server.connected), 0, image.writes, image.refused, longest)

    async def start(self) -> None:
        """Listen. Raises ServerError if that is not possible."""
        logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)  # it logs all input of clients
        host, port = self._at
        require_free(MODBUS, host, port)
        # The library requires a device; the image replaces it at each request.
        server = _Server(SimDevice(0, simdata=SimData(0, datatype=DataType.REGISTERS)), address=(host, port))
        server.image, server.holding = self._image, self._image.holding
        server.places = ConnectionSlots(self._quota, keeps_active=True)
        try:
            await server.serve_forever(background=True)
        except (OSError, RuntimeError) as error:
            raise ServerError(f"modbus: {host}:{port} can't be listened on ({error})") from error
        self._server = server
        self._watch = asyncio.create_task(server.watch())

    async def stop(self) -> None:
        """End all connections."""
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None
        if self._server is not None:
            self._image.holding.leave(self._image.holding.holder)
            await self._server.shutdown()
            self._server = None


class _Server(ModbusTcpServer):
    image: Any
    """An `_Image`, which the library uses as the memory of a device."""
    holding: HoldingService
    places: ConnectionSlots

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.connected: set[_Handler] = set()
        self.longest = 0.0  # longest wall time from a request to its answer since the last status, s

    def callback_new_connection(self) -> ServerRequestHandler:
        return _Handler(self, self.trace_packet, self.trace_pdu, self.trace_connect)

    async def watch(self) -> None:
        """Release the line repeatedly if its holder is silent or gone."""
        while True:
            await asyncio.sleep(_LOOK)
            now, holder = time.monotonic(), self.holding.holder
            if holder and all(one.writer != holder or now > one.asked + self.places.idle for one in self.connected):
                self.holding.leave(holder)
            self.holding.look()


class _Handler(ServerRequestHandler):
    """One connection. Its client is the writer of its requests."""

    server: _Server
    writer = ""
    """Writer in recorded inputs."""
    place: ConnectionSlot | None = None
    asked = 0.0
    """Wall time of the latest request, s."""
    _received = b""
    """Received bytes of unanswered requests."""
    _answering: asyncio.Task[None] | None = None

    def callback_connected(self) -> None:
        super().callback_connected()
        peer = self.transport.get_extra_info("peername")
        self.place = self.server.places.take(str(peer[0]) if peer else "", self.cut)
        if self.place is None:
            self.close()
            return
        self.server.connected.add(self)
        self.asked = time.monotonic()
        if peer is not None:
            self.writer = f"{MODBUS} {peer[0]}:{peer[1]}"
        if (connection := self.transport.get_extra_info("socket")) is not None:
            # Detect clients that vanish without closing the connection.
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_UNREAD)
            for option, value in _KEEP_ALIVE.items():
                connection.setsockopt(socket.IPPROTO_TCP, option, value)

    def callback_disconnected(self, exc: Exception | None) -> None:
        self.server.connected.discard(self)
        if self.place is not None:
            self.server.places.leave(self.place)
        self.server.holding.leave(self.writer)
        self.server.image.held.leave(self.writer)
        super().callback_disconnected(exc)

    @property
    def _stream(self) -> asyncio.Transport:
        assert isinstance(self.transport, asyncio.Transport)
        return self.transport

    def cut(self) -> None:
        """End the connection at once; unsent answers are lost."""
        self.server.connected.discard(self)
        self._stream.abort()

    def data_received(self, data: bytes) -> None:
        """Answer requests in their order. The library would drop all but the first of several in one packet."""
        self._received += data
        if len(self._received) > MOST_UNANSWERED:
            self._stream.pause_reading()
        if self._answering is None:
            self._answering = self.loop.create_task(self._answer_all())

    async def _answer_all(self) -> None:
        try:
            while self.is_active() and not self._stream.is_closing() and (asked := self._next()) is not None:
                began, self.asked = time.perf_counter(), time.monotonic()
                if self.place is not None:
                    self.place.touch(GUEST)
                if self._stream.get_write_buffer_size() > MOST_UNREAD:
                    self.cut()  # the client does not read its answers
                    return
                _writer.set(self.writer)
                self.server_send(await self._answer(*asked), None)
                self.server.longest = max(self.server.longest, time.perf_counter() - began)
                await asyncio.sleep(0)  # let other tasks run
        finally:
            self._answering = None
        if self.is_active() and not self._stream.is_closing():
            self._stream.resume_reading()

    def _next(self) -> tuple[int, int, bytes] | None:
        """Return transaction, unit, and function with data of the next request; None: there is no complete one."""
        if len(self._received) < _HEADER.size:
            return None
        transaction, protocol, length, unit = _HEADER.unpack_from(self._received)
        if protocol != 0 or length not in _LENGTHS:
            self.cut()  # the start of the next request is unknown
            return None
        end = _HEADER.size - 1 + length
        if len(self._received) < end:
            return None
        pdu, self._received = self._received[_HEADER.size : end], self._received[end:]
        return transaction, unit, pdu

    async def _answer(self, transaction: int, unit: int, asked: bytes) -> ModbusPDU:
        function = asked[0]
        # Some functions of the library would change the server for all clients.
        request = self.framer.decoder.decode(asked) if function in _TABLE_OF else None
        answer: ModbusPDU
        if function not in _TABLE_OF:
            answer = ExceptionResponse(function, ExcCodes.ILLEGAL_FUNCTION)
        elif request is None or (function == _ONE_COIL and asked[3:5] not in _ON_OR_OFF):
            answer = ExceptionResponse(function, ExcCodes.ILLEGAL_VALUE)
        else:
            try:
                answer = await request.datastore_update(self.server.image, unit)
            except Exception as error:  # the client needs an answer
                logging.getLogger(__name__).error("modbus: function %d failed: %r", function, error)
                answer = ExceptionResponse(function, ExcCodes.DEVICE_FAILURE)
            if function in (_ONE_COIL, _ONE_REGISTER) and not answer.isError():
                answer = (
                    request  # required by the standard; the library would answer with the value before the next tick
                )
        answer.transaction_id, answer.dev_id = transaction, unit
        return answer


class _Image:
    """Values of the line, in place of the memory of a device that the library expects."""

    def __init__(
        self, source: TagProvider, rows: Sequence[Row], role: WriterKind | None, holding: HoldingService
    ) -> None:
        self._source, self._role, self.holding = source, role, holding
        self._receipt = Receipt(source.info.tags, source.info.where)
        self._commands = {tag.name: tag for tag in source.info.tags if tag.role in COMMANDS}
        self.held = HeldButtons(source)
        self._rows: Mapping[tuple[Table, int], Row] = {(row.table, at): row for row in rows for at in row.addresses}
        self.writes = self.refused = 0

    async def async_getValues(self, device: int, function: int, address: int, count: int = 1) -> Any:
        """Return words or bits of one tick, (count,)."""
        table, snapshot = _TABLE_OF[function], self._source.snapshot
        if snapshot.lost:
            return ExcCodes.GATEWAY_NO_RESPONSE
        values: list[int] = []
        while len(values) < count:
            at = address + len(values)
            row = self._rows.get((table, at))
            if row is None:
                return ExcCodes.ILLEGAL_ADDRESS
            value = float(snapshot.tick) if row.name in (TICK, TARGET) else snapshot.values.get(_shown_as(row), 0.0)
            words = encode(row, value)  # 0 for a tag that the line no longer has
            values += words[at - row.address :]
        values = values[:count]
        return [bool(value) for value in values] if table in ("coil", "discrete input") else values

    async def async_setValues(self, device: int, function: int, address: int, values: Sequence[int]) -> Any:
        """Pass values on to the line together. Return None if they were accepted, an exception code otherwise."""
        problem = self._write(_TABLE_OF[function], address, list(values))
        self.writes, self.refused = self.writes + (problem is None), self.refused + (problem is not None)
        return problem

    def _write(self, table: Table, address: int, words: list[int]) -> ExcCodes | None:
        if self._role is None:
            return ExcCodes.ILLEGAL_FUNCTION
        if self._source.snapshot.lost:
            return ExcCodes.GATEWAY_NO_RESPONSE
        names: list[str] = []
        numbers: list[float] = []
        while words:
            row = self._rows.get((table, address))
            if row is None or row.access == "read" or row.address != address or row.words > len(words):
                return ExcCodes.ILLEGAL_ADDRESS
            names.append(row.name)
            numbers.append(decode(row, words[: row.words]))
            words, address = words[row.words :], address + row.words
        if any(name.endswith(SET_MODE) for name in names):
            return self._put_into_mode(names, numbers)
        # It has the last address, so a request writes it last.
        target = numbers.pop() if names[-1] == TARGET and names.pop() else None
        writer = claimant = _writer.get()
        request = Input(MODBUS, writer, self._role, SET, tuple(names), tuple(numbers))
        if names and (refusal := refused_for_good(self._source, self._receipt, request)):
            return _EXCEPTIONS[refusal.cause]
        if self._role == "controller" and self._source.snapshot.owner not in ("", writer):
            claimant = self.holding.judged_as(writer)
        commands = [self._commands[name] for name in names]
        if any(
            objection(self._source, tag, value, self._role, claimant)
            for tag, value in zip(commands, numbers, strict=True)
        ):
            return ExcCodes.DEVICE_BUSY
        in_lockstep = "target" in self._source.controls
        if target is not None and self._role not in MAY_GO_ON:
            return ExcCodes.ILLEGAL_FUNCTION
        if target is not None and not in_lockstep:
            return ExcCodes.DEVICE_BUSY
        # In lockstep, the attached PLC owns the line.
        if self._role == "controller" and not in_lockstep and self.holding.take(writer):
            return ExcCodes.DEVICE_BUSY
        if names and self._source.give(request):
            return ExcCodes.DEVICE_BUSY
        self.held.note(writer, request)
        if target is None:
            return None
        return ExcCodes.ILLEGAL_VALUE if self._source.control("target", target, writer) else None

    def _put_into_mode(self, names: list[str], modes: list[float]) -> ExcCodes | None:
        """Set the control modes of devices. The request must hold nothing else."""
        if self._role is None or self._role not in MAY[MODE].writers:
            return ExcCodes.ILLEGAL_FUNCTION
        if not all(name.endswith(SET_MODE) for name in names):
            return ExcCodes.ILLEGAL_ADDRESS
        devices = tuple(name.removesuffix(SET_MODE) for name in names)
        request = Input(MODBUS, _writer.get(), self._role, MODE, devices, tuple(modes))
        if refusal := refused_for_good(self._source, self._receipt, request):
            return _EXCEPTIONS[refusal.cause]
        return ExcCodes.DEVICE_BUSY if self._source.give(request) else None


def _shown_as(row: Row) -> str:
    """Return the name of the tag that a row reads."""
    return f"{row.name.removesuffix(SET_MODE)}/mode" if row.name.endswith(SET_MODE) else row.name

# SPDX-License-Identifier: Apache-2.0
"""`ModbusLink`: access to the registers of a PLC that is a Modbus TCP server."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, get_args

from pymodbus.client import AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException

from conveyor_sim.protocols.attach.plc_link import PATIENCE, PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError
from conveyor_sim.support.modbus_rows import MOST_ADDRESSES, Row, Table, Type, WordOrder, decode, encode
from conveyor_sim.support.printable import printable

MOST_WORDS, MOST_BITS = 120, 1920
"""Largest numbers of words and bits of one request. The protocol allows 123 and 1968 to write, 125 and 2000 to read."""

_BITS: tuple[Table, ...] = ("coil", "discrete input")
_WRITABLE: tuple[Table, ...] = ("coil", "holding register")
_WRITABLE_TEXT = " or ".join(f"a {table}" for table in _WRITABLE)


class ModbusLink:
    """Link by Modbus TCP. Neighbouring addresses are read and written in one request."""

    def __init__(self, host: str, port: int, mapped: Sequence[MappedTag]) -> None:
        """Read the places of the mapped tags. Raise TagMapError for an invalid one."""
        self._url, self._at = f"modbus://{host}:{port}", (host, port)
        self._rows = {each.tag.name: _row(each) for each in mapped}
        self._client: AsyncModbusTcpClient | None = None

    async def connect(self) -> None:
        """Connect, and read every place of the map once to check that the PLC has it."""
        logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)  # PlcLinkError reports the same
        host, port = self._at
        client = AsyncModbusTcpClient(host, port=port, timeout=PATIENCE, retries=0, reconnect_delay=0)
        self._client = client
        if not await asyncio.wait_for(client.connect(), 2.0 * PATIENCE):
            raise PlcLinkError(f"{self._url}: can't be reached, expected the Modbus server of a PLC")
        await self.read(list(self._rows))

    async def write(self, values: Mapping[str, float]) -> None:
        """Set coils and holding registers, in the order of the values."""
        client = self._connected()
        for rows in _runs(self._rows[name] for name in values):
            if rows[0].table not in _WRITABLE:
                raise PlcLinkError(f"{self._url}: {rows[0].name} can't be written, expected {_WRITABLE_TEXT}")
            words = [word for row in rows for word in encode(row, values[row.name])]
            if rows[0].table == "coil":
                await self._ask(rows, client.write_coils, rows[0].address, [bool(word) for word in words])
            else:
                await self._ask(rows, client.write_registers, rows[0].address, words)

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""
        client, values = self._connected(), {}
        ask = {
            "coil": client.read_coils,
            "discrete input": client.read_discrete_inputs,
            "holding register": client.read_holding_registers,
            "input register": client.read_input_registers,
        }
        for rows in _runs(sorted((self._rows[name] for name in names), key=lambda row: (row.table, row.address))):
            first, count = rows[0].address, rows[-1].addresses.stop - rows[0].address
            answer = await self._ask(rows, ask[rows[0].table], first, count=count)
            words = answer.bits if rows[0].table in _BITS else answer.registers
            for row in rows:
                values[row.name] = decode(row, words[row.address - first : row.addresses.stop - first])
        return values

    async def close(self) -> None:
        """Disconnect."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _connected(self) -> AsyncModbusTcpClient:
        if self._client is None:
            raise PlcLinkError(f"{self._url}: is not connected")
        return self._client

    async def _ask(self, rows: Sequence[Row], request: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        try:
            answer = await asyncio.wait_for(request(*arguments, **more), 2.0 * PATIENCE)
        except (ModbusException, OSError, asyncio.TimeoutError) as error:
            raise PlcLinkError(f"{self._url}: does not answer ({printable(error) or 'in time'})") from error
        if answer.isError():
            row = rows[0]
            code = getattr(answer, "exception_code", "?")
            raise PlcLinkError(f"{self._url}: {row.table} {row.address} ({row.name}) is refused with exception {code}")
        return answer


def _runs(rows: Iterable[Row]) -> Iterator[list[Row]]:
    """Yield runs of rows at consecutive addresses, each short enough for one request."""
    run: list[Row] = []
    for row in rows:
        last = run[-1] if run else None
        if last is not None and (
            (last.table, last.addresses.stop) != (row.table, row.address)
            or row.addresses.stop - run[0].address > (MOST_BITS if row.table in _BITS else MOST_WORDS)
        ):
            yield run
            run = []
        run.append(row)
    if run:
        yield run


def _row(mapped: MappedTag) -> Row:
    expected = 'expected such as "coil 3 bool", "holding register 12 float32 big"'
    words = mapped.theirs.split()
    table = next((table for table in get_args(Table) if mapped.theirs.startswith(f"{table} ")), None)
    rest = words[len(table.split()) :] if table else []
    order: WordOrder = "little" if rest[2:] == ["little"] else "big"
    if table is None or len(rest) not in (2, 3) or rest[1] not in get_args(Type) or rest[2:] not in ([], [order]):
        raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} given, {expected}")
    kind: Type = rest[1]  # type: ignore[assignment]
    if not (rest[0].isascii() and rest[0].isdigit() and int(rest[0]) < MOST_ADDRESSES):
        raise TagMapError(f"{mapped.where}: address {printable(rest[0])} given, expected 0 to {MOST_ADDRESSES - 1}")
    if (kind == "bool") != (table in _BITS):
        raise TagMapError(f"{mapped.where}: {kind} given in a {table}, {expected}")
    tag = mapped.tag
    if mapped.is_written and table not in _WRITABLE:
        raise TagMapError(f"{mapped.where}: {tag.name} is written, but {table}s can't be, expected {_WRITABLE_TEXT}")
    return Row(tag.name, table, int(rest[0]), kind, order, tag.unit, "read", tag.low, tag.high, "")

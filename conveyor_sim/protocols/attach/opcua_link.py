# SPDX-License-Identifier: Apache-2.0
"""`OpcUaLink`: access to the variables of a PLC that is an OPC UA server."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Mapping, Sequence
from contextlib import suppress
from typing import TypeVar

from asyncua import Client, ua
from asyncua.ua.uaerrors import UaError

from conveyor_sim.protocols.attach.plc_link import PATIENCE, PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError
from conveyor_sim.support.printable import printable
from conveyor_sim.support.rounded_limit import at_limit

T = TypeVar("T")

_INTEGERS = {
    kind: (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    for bits, signed, kind in (
        (8, True, ua.VariantType.SByte),
        (8, False, ua.VariantType.Byte),
        (16, True, ua.VariantType.Int16),
        (16, False, ua.VariantType.UInt16),
        (32, True, ua.VariantType.Int32),
        (32, False, ua.VariantType.UInt32),
        (64, True, ua.VariantType.Int64),
        (64, False, ua.VariantType.UInt64),
    )
}
_REAL = (ua.VariantType.Float, ua.VariantType.Double)


class OpcUaLink:
    """Link by OPC UA. All values of one call are one request."""

    def __init__(self, url: str, mapped: Sequence[MappedTag], user: str, password: str) -> None:
        """Read the node IDs of the mapped tags. user: "" for anonymous. Raises TagMapError for an invalid ID."""
        self._url, self._mapped = url, {each.tag.name: each for each in mapped}
        self._user, self._password = user, password
        self._ids = {each.tag.name: _node_id(each) for each in mapped}
        self._types: dict[str, ua.VariantType] = {}
        self._client: Client | None = None

    async def connect(self) -> None:
        """Connect, and read the type of each variable."""
        logging.getLogger("asyncua.client").setLevel(logging.CRITICAL)  # PlcLinkError reports the same
        # By default it disconnects from a server that has not answered for a second.
        client = Client(self._url, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        if self._user:
            client.set_user(self._user)
            client.set_password(self._password)
        await self._ask(client.connect())
        self._client = client
        for name, node in self._ids.items():
            mapped = self._mapped[name]
            try:
                value = await self._ask(client.get_node(node).read_data_value(raise_on_bad_status=False))
            except PlcLinkError as error:
                raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)}: {error}") from error
            if (bad := _problem(value)) is not None:
                raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} is {bad}, expected a number or a bool")
            self._types[name] = value.Value.VariantType

    async def write(self, values: Mapping[str, float]) -> None:
        """Write variables, by our names."""
        client = self._connected()
        nodes = [client.get_node(self._ids[name]) for name in values]
        variants = [ua.DataValue(_variant(self._types[name], value)) for name, value in values.items()]
        await self._ask(client.write_values(nodes, variants))

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names. Raise PlcLinkError for a value with a bad status as well."""
        client, values = self._connected(), {}
        nodes = [client.get_node(self._ids[name]) for name in names]
        for name, data in zip(names, await self._ask(client.read_attributes(nodes)), strict=True):
            if (bad := _problem(data)) is not None:
                raise PlcLinkError(f"{self._url}: {printable(self._mapped[name].theirs)} ({name}) is {bad}")
            value, tag = float(data.Value.Value), self._mapped[name].tag
            is_single = data.Value.VariantType is ua.VariantType.Float
            values[name] = at_limit(value, tag.low, tag.high) if is_single else value
        return values

    async def close(self) -> None:
        """Disconnect."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(PlcLinkError):  # the server has disconnected
                await self._ask(client.disconnect())

    def _connected(self) -> Client:
        if self._client is None:
            raise PlcLinkError(f"{self._url}: is not connected")
        return self._client

    async def _ask(self, request: Awaitable[T]) -> T:
        try:
            return await asyncio.wait_for(request, 2.0 * PATIENCE)
        except (UaError, OSError, asyncio.TimeoutError) as error:
            raise PlcLinkError(f"{self._url}: {printable(error) or type(error).__name__}") from error


def _problem(data: ua.DataValue) -> str | None:
    """Return why a value is no number or bool, in words; None if it is one."""
    if data.StatusCode.is_bad():
        return printable(data.StatusCode.name)
    if data.Value.is_array:
        return "an array"
    kind = data.Value.VariantType
    return None if kind in (*_INTEGERS, *_REAL, ua.VariantType.Boolean) else printable(kind.name)


def _node_id(mapped: MappedTag) -> ua.NodeId:
    try:
        return ua.NodeId.from_string(mapped.theirs)
    except (UaError, ValueError) as error:
        expected = "expected a NodeId such as ns=4;s=GVL.Speed1"
        raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} given, {expected}") from error


def _variant(kind: ua.VariantType, value: float) -> ua.Variant:
    """Return a variant of a type. A value out of the range of an integer becomes the nearest limit."""
    if kind is ua.VariantType.Boolean:
        return ua.Variant(value != 0.0, kind)
    if kind in _REAL:
        return ua.Variant(float(value), kind)
    low, high = _INTEGERS[kind]
    return ua.Variant(int(min(high, max(low, value))) if math.isfinite(value) else 0, kind)

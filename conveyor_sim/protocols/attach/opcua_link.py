"""`OpcUaLink`: the way to the variables of a PLC that is an OPC UA server."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Mapping, Sequence
from contextlib import suppress
from typing import TypeVar

from asyncua import Client, ua
from asyncua.ua.uaerrors import UaError

from conveyor_sim.protocols.attach.link import PATIENCE, LinkError
from conveyor_sim.protocols.attach.tag_map import Mapped, TagMapError
from conveyor_sim.support.printable import printable
from conveyor_sim.support.rounded_limit import at_limit

T = TypeVar("T")

_WHOLE = {
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
    """All values of one call are one request."""

    def __init__(self, url: str, mapped: Sequence[Mapped], user: str, password: str) -> None:
        """user: "" for anonymous. Raises TagMapError."""
        self._url, self._mapped = url, {each.tag.name: each for each in mapped}
        self._user, self._password = user, password
        self._ids = {each.tag.name: _node_id(each) for each in mapped}
        self._types: dict[str, ua.VariantType] = {}
        self._client: Client | None = None

    async def connect(self) -> None:
        """Reach it, and find the type of each variable."""
        logging.getLogger("asyncua.client").setLevel(logging.CRITICAL)  # it logs what LinkError says
        # By itself it leaves a server that has not answered for a second.
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
            except LinkError as error:
                raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)}: {error}") from error
            if (bad := _problem(value)) is not None:
                raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} is {bad}, expected a number or a bool")
            self._types[name] = value.Value.VariantType

    async def write(self, values: Mapping[str, float]) -> None:
        """Set variables."""
        client = self._there()
        nodes = [client.get_node(self._ids[name]) for name in values]
        variants = [ua.DataValue(_variant(self._types[name], value)) for name, value in values.items()]
        await self._ask(client.write_values(nodes, variants))

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values by our names. LinkError, too, for one that the PLC itself calls bad."""
        client, found = self._there(), {}
        nodes = [client.get_node(self._ids[name]) for name in names]
        for name, data in zip(names, await self._ask(client.read_attributes(nodes)), strict=True):
            if (bad := _problem(data)) is not None:
                raise LinkError(f"{self._url}: {printable(self._mapped[name].theirs)} ({name}) is {bad}")
            value, tag = float(data.Value.Value), self._mapped[name].tag
            is_single = data.Value.VariantType is ua.VariantType.Float
            found[name] = at_limit(value, tag.low, tag.high) if is_single else value
        return found

    async def close(self) -> None:
        """Leave it."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(LinkError):  # it has left us
                await self._ask(client.disconnect())

    def _there(self) -> Client:
        if self._client is None:
            raise LinkError(f"{self._url}: is not reached")
        return self._client

    async def _ask(self, request: Awaitable[T]) -> T:
        try:
            return await asyncio.wait_for(request, 2.0 * PATIENCE)
        except (UaError, OSError, asyncio.TimeoutError) as error:
            raise LinkError(f"{self._url}: {printable(error) or type(error).__name__}") from error


def _problem(data: ua.DataValue) -> str | None:
    """What it is instead of a number or a bool; None: one of these."""
    if data.StatusCode.is_bad():
        return printable(data.StatusCode.name)
    if data.Value.is_array:
        return "an array"
    kind = data.Value.VariantType
    return None if kind in (*_WHOLE, *_REAL, ua.VariantType.Boolean) else printable(kind.name)


def _node_id(mapped: Mapped) -> ua.NodeId:
    try:
        return ua.NodeId.from_string(mapped.theirs)
    except (UaError, ValueError) as error:
        expected = "expected a NodeId such as ns=4;s=GVL.Speed1"
        raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} given, {expected}") from error


def _variant(kind: ua.VariantType, value: float) -> ua.Variant:
    """What a whole number can't hold becomes the nearest that it can."""
    if kind is ua.VariantType.Boolean:
        return ua.Variant(value != 0.0, kind)
    if kind in _REAL:
        return ua.Variant(float(value), kind)
    low, high = _WHOLE[kind]
    return ua.Variant(int(min(high, max(low, value))) if math.isfinite(value) else 0, kind)

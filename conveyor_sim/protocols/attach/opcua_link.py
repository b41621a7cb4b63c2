# SPDX-License-Identifier: Apache-2.0
"""`OpcUaLink`: access to the variables of a PLC that is an OPC UA server."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from asyncua import Client, ua
from asyncua.ua.uaerrors import UaError

from conveyor_sim.protocols.attach.access import ANONYMOUS, PlcAccess
from conveyor_sim.protocols.attach.opcua_client import close_client, open_client
from conveyor_sim.protocols.attach.opcua_requests import OpcUaRequests, is_writable
from conveyor_sim.protocols.attach.plc_link import PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError
from conveyor_sim.support.printable import printable
from conveyor_sim.support.rounded_limit import at_limit

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
    """Link by OPC UA. Values of one call are one request, or as many as the limits of the server require."""

    def __init__(
        self,
        url: str,
        mapped: Sequence[MappedTag],
        access: PlcAccess = ANONYMOUS,
        say: Callable[[str], object] = lambda _: None,
    ) -> None:
        """Read the node IDs of the mapped tags. access, say: as for `open_client`.

        Raises TagMapError for an invalid ID.
        """
        self._url, self._mapped = url, {each.tag.name: each for each in mapped}
        self._access, self._say = access, say
        self._places = {each.tag.name: _Place.read(each) for each in mapped}
        self._ids: dict[str, ua.NodeId] = {}
        self._types: dict[str, ua.VariantType] = {}
        self._requests: OpcUaRequests | None = None
        self._client: Client | None = None

    async def connect(self) -> None:
        """Connect, resolve namespaces, and read type and access of each variable."""
        self._client = client = await open_client(self._url, self._access, self._say)
        self._requests = requests = OpcUaRequests(self._url, client)
        await requests.read_limits()
        uris = await requests.namespaces() if any(place.uri for place in self._places.values()) else []
        self._ids = {name: place.node(uris) for name, place in self._places.items()}
        ids = list(self._ids.values())
        values = await requests.read([(node, ua.AttributeIds.Value) for node in ids])
        rights = await requests.read([(node, ua.AttributeIds.UserAccessLevel) for node in ids])
        for (name, mapped), value, right in zip(self._mapped.items(), values, rights, strict=True):
            theirs = printable(mapped.theirs)
            if (bad := problem(value)) is not None:
                raise TagMapError(f"{mapped.where}: {theirs} is {bad}, expected a number or a bool")
            if mapped.is_written and not is_writable(right):
                raise TagMapError(
                    f"{mapped.where}: {theirs} is read-only, but {name} is written, expected write access"
                )
            self._types[name] = value.Value.VariantType

    async def write(self, values: Mapping[str, float]) -> None:
        """Write variables, by our names."""
        # Without a status, because servers may refuse to write one.
        variants = [ua.DataValue(_variant(self._types[name], value), StatusCode=None) for name, value in values.items()]
        codes = await self._connected().write([self._ids[name] for name in values], variants)
        for name, code in zip(values, codes, strict=True):
            if not code.is_good():
                theirs = printable(self._mapped[name].theirs)
                raise PlcLinkError(f"{self._url}: refuses {theirs} ({name}) with {printable(code.name)}")

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names. Raise PlcLinkError for a value with a bad status as well."""
        values = {}
        answer = await self._connected().read([(self._ids[name], ua.AttributeIds.Value) for name in names])
        for name, data in zip(names, answer, strict=True):
            if (bad := problem(data)) is not None:
                raise PlcLinkError(f"{self._url}: {printable(self._mapped[name].theirs)} ({name}) is {bad}")
            value, tag = float(data.Value.Value), self._mapped[name].tag
            is_single = data.Value.VariantType is ua.VariantType.Float
            values[name] = at_limit(value, tag.low, tag.high) if is_single else value
        return values

    async def close(self) -> None:
        """Disconnect."""
        client, self._client, self._requests = self._client, None, None
        if client is not None:
            await close_client(self._url, client)

    def _connected(self) -> OpcUaRequests:
        if self._requests is None:
            raise PlcLinkError(f"{self._url}: is not connected")
        return self._requests


class _Place(NamedTuple):
    """Node of a map; its namespace is an index of the server, or a URI of which the index may change."""

    mapped: MappedTag
    uri: str
    node_id: ua.NodeId

    @classmethod
    def read(cls, mapped: MappedTag) -> _Place:
        """Read `theirs`. Raise TagMapError."""
        text, uri = mapped.theirs.strip(), ""
        if text.startswith("nsu="):
            uri, _, text = text.removeprefix("nsu=").partition(";")
            # OPC 10000-6, 5.1.12: ";" and "%" within a URI are escaped.
            uri = uri.replace("%3B", ";").replace("%3b", ";").replace("%25", "%")
        try:
            node = ua.NodeId.from_string(text)
            if isinstance(node, ua.ExpandedNodeId) or (uri and node.NamespaceIndex) or text == mapped.theirs == "":
                raise ValueError(text)
        except (UaError, ValueError) as error:
            expected = "expected a NodeId such as ns=4;s=GVL.Speed1 or nsu=urn:plc;s=GVL.Speed1"
            raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} given, {expected}") from error
        return cls(mapped, uri, node)

    def node(self, uris: Sequence[str]) -> ua.NodeId:
        """Return the node ID for the namespaces of a server. Raise TagMapError if it lacks the URI."""
        if not self.uri:
            return self.node_id
        if self.uri not in uris:
            listed = printable(", ".join(map(str, uris)))
            raise TagMapError(
                f"{self.mapped.where}: namespace {printable(self.uri)} given, expected one of the PLC's: {listed}"
            )
        return ua.NodeId(self.node_id.Identifier, uris.index(self.uri), self.node_id.NodeIdType)


def problem(data: ua.DataValue) -> str | None:
    """Return why a value is no number or bool, in words; None if it is one."""
    if data.StatusCode is not None and data.StatusCode.is_bad():
        return printable(data.StatusCode.name)
    if data.Value is None or data.Value.Value is None:
        return "without a value"
    if data.Value.is_array or isinstance(data.Value.Value, list):
        return "an array"
    kind = data.Value.VariantType
    return None if kind in (*_INTEGERS, *_REAL, ua.VariantType.Boolean) else printable(kind.name)


def _variant(kind: ua.VariantType, value: float) -> ua.Variant:
    """Return a variant of a type. A value out of the range of an integer becomes the nearest limit."""
    if kind is ua.VariantType.Boolean:
        return ua.Variant(value != 0.0, kind)
    if kind in _REAL:
        return ua.Variant(float(value), kind)
    low, high = _INTEGERS[kind]
    return ua.Variant(int(min(high, max(low, value))) if math.isfinite(value) else 0, kind)

# SPDX-License-Identifier: Apache-2.0
"""`OpcUaRequests`: reads, writes and browses of any number of nodes, within the limits of the server per request."""

from __future__ import annotations

from collections.abc import Awaitable, Sequence
from typing import NamedTuple, TypeVar

from asyncua import Client, ua

from conveyor_sim.protocols.attach.opcua_client import ask
from conveyor_sim.protocols.attach.plc_link import PlcLinkError

T = TypeVar("T")

MOST_NODES = 1000
"""Largest number of nodes of one request to a server that states no limits."""

MOST_REFERENCES = 1000
"""Largest number of references of one node in an answer; a continuation point leads to the others."""

_WRITABLE = 2
"""Bit CurrentWrite of an access level (OPC 10000-3, 8.57)."""


class RequestLimits(NamedTuple):
    """Largest number of nodes per request (OPC 10000-5, 6.3.11)."""

    read: int = MOST_NODES
    write: int = MOST_NODES
    browse: int = MOST_NODES


_LIMITS = RequestLimits(
    ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerRead,
    ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerWrite,
    ua.ObjectIds.Server_ServerCapabilities_OperationLimits_MaxNodesPerBrowse,
)


class OpcUaRequests:
    """Requests to one server. All methods raise PlcLinkError for an answer that is missing or malformed."""

    def __init__(self, url: str, client: Client, patience: float | None = None) -> None:
        """Begin with the limits of `MOST_NODES`. url: for errors. patience: as for `open_client`."""
        self._url, self._client, self._patience = url, client, patience
        self.limits = RequestLimits()

    async def read_limits(self) -> None:
        """Read the limits of the server. 0, and a limit that it does not have, stand for none."""
        values = []
        for node in _LIMITS:  # one by one, because a limit of one node per read is possible
            (data,) = await self.read([(ua.NodeId(node), ua.AttributeIds.Value)])
            value = data.Value.Value if data.Value is not None else None
            values.append(min(value, MOST_NODES) if isinstance(value, int) and value > 0 else MOST_NODES)
        self.limits = RequestLimits(*values)

    async def namespaces(self) -> list[str]:
        """Return the URIs of the namespaces, in order of their indices."""
        (data,) = await self.read([(ua.NodeId(ua.ObjectIds.Server_NamespaceArray), ua.AttributeIds.Value)])
        uris = data.Value.Value if data.Value is not None else None
        if not isinstance(uris, list):
            raise PlcLinkError(f"{self._url}: has no NamespaceArray, expected its namespaces")
        return [str(uri) for uri in uris]

    async def read(self, places: Sequence[tuple[ua.NodeId, ua.AttributeIds]]) -> list[ua.DataValue]:
        """Return the values of attributes of nodes, bad ones with their status."""
        values: list[ua.DataValue] = []
        for start in range(0, len(places), self.limits.read):
            part = places[start : start + self.limits.read]
            parameters = ua.ReadParameters(
                TimestampsToReturn=ua.TimestampsToReturn.Neither,
                NodesToRead=[ua.ReadValueId(node, attribute) for node, attribute in part],
            )
            values += self._all(await self._ask(self._client.uaclient.read(parameters)), len(part))
        return values

    async def write(self, nodes: Sequence[ua.NodeId], values: Sequence[ua.DataValue]) -> list[ua.StatusCode]:
        """Write values, in this order. Return the status of each."""
        codes: list[ua.StatusCode] = []
        for start in range(0, len(nodes), self.limits.write):
            stop = start + self.limits.write
            part = [
                ua.WriteValue(node, ua.AttributeIds.Value, Value=value)
                for node, value in zip(nodes[start:stop], values[start:stop], strict=True)
            ]
            answer = await self._ask(self._client.uaclient.write(ua.WriteParameters(NodesToWrite=part)))
            codes += self._all(answer, len(part))
        return codes

    async def children(self, nodes: Sequence[ua.NodeId]) -> list[list[ua.ReferenceDescription]]:
        """Return the objects and variables below each node; none where the server refuses to browse it."""
        children: list[list[ua.ReferenceDescription]] = []
        for start in range(0, len(nodes), self.limits.browse):
            part = nodes[start : start + self.limits.browse]
            for node, result in zip(part, await self._browse(part), strict=True):
                if result.StatusCode.value == ua.StatusCodes.BadNoContinuationPoints and len(part) > 1:
                    (result,) = await self._browse([node])  # the server keeps few at a time
                children.append(await self._complete(result))
        return children

    async def _browse(self, nodes: Sequence[ua.NodeId]) -> Sequence[ua.BrowseResult]:
        parameters = ua.BrowseParameters(
            RequestedMaxReferencesPerNode=MOST_REFERENCES, NodesToBrowse=[_below(node) for node in nodes]
        )
        return self._all(await self._ask(self._client.uaclient.browse(parameters)), len(nodes))

    async def _complete(self, result: ua.BrowseResult) -> list[ua.ReferenceDescription]:
        references = list(result.References or ())
        while result.ContinuationPoint and result.References:
            following = ua.BrowseNextParameters(False, [result.ContinuationPoint])
            (result,) = self._all(await self._ask(self._client.uaclient.browse_next(following)), 1)
            references += result.References or ()
        return references

    async def _ask(self, request: Awaitable[T]) -> T:
        return await ask(self._url, request, self._patience)

    def _all(self, answer: Sequence[T] | None, count: int) -> Sequence[T]:
        if answer is None or len(answer) != count:
            number = 0 if answer is None else len(answer)
            raise PlcLinkError(f"{self._url}: answers with {number} values, expected {count}")
        return answer


def is_writable(access_level: ua.DataValue) -> bool:
    """Return True unless an attribute UserAccessLevel denies writing. Servers may lack the attribute."""
    level = access_level.Value.Value if access_level.Value is not None else None
    return not isinstance(level, int) or bool(level & _WRITABLE)


def _below(node: ua.NodeId) -> ua.BrowseDescription:
    return ua.BrowseDescription(
        NodeId=node,
        BrowseDirection=ua.BrowseDirection.Forward,
        ReferenceTypeId=ua.NodeId(ua.ObjectIds.HierarchicalReferences),
        IncludeSubtypes=True,
        NodeClassMask=ua.NodeClass.Object | ua.NodeClass.Variable,
        ResultMask=ua.BrowseResultMask.All,
    )

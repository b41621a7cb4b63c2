"""Publication of the server's limits in its address space, for clients (OPC 10000-5, 6.3.2 and 6.3.11)."""

from __future__ import annotations

from asyncua import ua
from asyncua.server.internal_server import InternalServer

from conveyor_sim.protocols.opcua.limits import PUBLISHED, UNSUPPORTED, OpcUaLimits
from conveyor_sim.protocols.server.quotas import Quota

_CAPABILITIES = "Server_ServerCapabilities_"

_SHORT = ("MaxBrowseContinuationPoints",)
"""Nodes of type UInt16; the others are UInt32."""


async def publish(server: InternalServer, limits: OpcUaLimits, quota: Quota) -> None:
    """Write all limits that have a node. Raises UaStatusCodeError if a node is missing."""
    values = {name: int(getattr(limits, field)) for name, field in PUBLISHED.items()}
    values |= dict.fromkeys(UNSUPPORTED, 1) | {"MaxSessions": quota.connections}
    for name, value in values.items():
        kind = ua.VariantType.UInt16 if name in _SHORT else ua.VariantType.UInt32
        node = ua.NodeId(getattr(ua.ObjectIds, _CAPABILITIES + name))
        written = ua.DataValue(ua.Variant(min(value, 0xFFFF) if name in _SHORT else value, kind))
        (await server.aspace.write_attribute_value(node, ua.AttributeIds.Value, written)).check()

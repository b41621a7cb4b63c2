"""Number of operations of a request, read before its operations are decoded, and the limit of each service.

The library decodes all operations of a request before a session sees them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from asyncua import ua
from asyncua.common.utils import Buffer, ServiceError
from asyncua.ua.ua_binary import Primitives, extensionobject_from_binary, struct_from_binary

from conveyor_sim.protocols.opcua.limits import OpcUaLimits

Codes = ua.StatusCodes

Skip = Callable[[Buffer], object]
"""Reads the fields of a request before its list of operations."""


def _bytes(count: int) -> Skip:
    return lambda body: body.skip(count)


def _view(body: Buffer) -> None:
    """Read View and RequestedMaxReferencesPerNode."""
    struct_from_binary(ua.ViewDescription, body)
    body.skip(4)


def _history(body: Buffer) -> None:
    """Read HistoryReadDetails, TimestampsToReturn and ReleaseContinuationPoints."""
    extensionobject_from_binary(body)
    body.skip(5)


_SERVICES: Mapping[str, tuple[Skip, str]] = {
    "Read": (_bytes(12), "nodes_per_read"),
    "Write": (_bytes(0), "nodes_per_write"),
    "Browse": (_view, "nodes_per_browse"),
    "BrowseNext": (_bytes(1), "nodes_per_browse"),
    "TranslateBrowsePathsToNodeIds": (_bytes(0), "nodes_per_translate"),
    "RegisterNodes": (_bytes(0), "nodes_per_register"),
    "UnregisterNodes": (_bytes(0), "nodes_per_register"),
    "HistoryRead": (_history, "nodes_per_history_read"),
    "Call": (_bytes(0), "methods_per_call"),
    "CreateMonitoredItems": (_bytes(8), "items_per_call"),
    "ModifyMonitoredItems": (_bytes(8), "items_per_call"),
    "DeleteMonitoredItems": (_bytes(4), "items_per_call"),
    "SetMonitoringMode": (_bytes(8), "items_per_call"),
    "SetPublishingMode": (_bytes(1), "subscriptions"),
    "TransferSubscriptions": (_bytes(0), "subscriptions"),
    "DeleteSubscriptions": (_bytes(0), "subscriptions"),
}
"""Fields before the operations, and the field of `OpcUaLimits`, by service (OPC 10000-4, 5)."""

_BY_TYPE = {
    ua.NodeId(getattr(ua.ObjectIds, f"{name}Request_Encoding_DefaultBinary")): entry
    for name, entry in _SERVICES.items()
}


def require_operations(type_id: ua.NodeId, body: Buffer, limits: OpcUaLimits) -> int:
    """Return the number of operations of a request; 0 for services without a list of them. The body is not consumed.

    Raise ServiceError with BadTooManyOperations, or BadNothingToDo for an empty list.
    """
    if type_id not in _BY_TYPE:
        return 0
    skip, field = _BY_TYPE[type_id]
    ahead = body.copy()
    try:
        skip(ahead)
        count = int(Primitives.Int32.unpack(ahead))
    except (ServiceError, RecursionError):
        raise
    except Exception as error:  # the library raises several kinds
        raise ServiceError(Codes.BadDecodingError) from error
    if count <= 0:
        raise ServiceError(Codes.BadNothingToDo)
    if count > getattr(limits, field):
        raise ServiceError(Codes.BadTooManyOperations)
    return count

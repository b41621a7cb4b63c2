# SPDX-License-Identifier: Apache-2.0
"""`WhereClause`: evaluation of the where clause of an event filter (OPC 10000-4, 7.7.3)."""

from __future__ import annotations

from functools import lru_cache
from logging import Logger
from typing import Any

from asyncua import ua

from conveyor_sim.protocols.opcua.asyncua_internals import OpenWhereClause


class WhereClause(OpenWhereClause):
    """Clause of the event filter of one monitored item. An element that can't be evaluated holds for no event."""

    def __init__(self, logger: Logger, aspace: Any, where: ua.ContentFilter) -> None:
        """logger: gets elements that can't be evaluated. aspace: address space with the event types."""
        super().__init__(logger, aspace, where)
        self._types = lru_cache(maxsize=100)(lambda kind: frozenset(supertypes(aspace, kind)))

    def element(self, index: int, event: Any) -> Any:
        """Return the value of an element. OfType holds for a type and all its subtypes."""
        element = self.elements[index]
        if element.FilterOperator == ua.FilterOperator.OfType:
            return plain(self.operand(element.FilterOperands[0], event)) in self._types(event.EventType)
        return super().element(index, event)

    def operand(self, operand: Any, event: Any) -> Any:
        """Return the value of an operand. A field below another one, such as ActiveState/Id, has its path as name."""
        if isinstance(operand, ua.SimpleAttributeOperand) and len(operand.BrowsePath or ()) > 1:
            return getattr(event, "/".join(part.Name for part in operand.BrowsePath))
        return super().operand(operand, event)


def supertypes(aspace: Any, kind: ua.NodeId) -> list[ua.NodeId]:
    """Return a type and its supertypes, the most derived first."""
    found = [kind]
    while (node := aspace.get(found[-1])) is not None:
        inverse = (ref.NodeId for ref in node.references if ref.ReferenceTypeId == _SUBTYPE and not ref.IsForward)
        above = next(inverse, None)
        if above is None or above in found:
            break
        found.append(above)
    return found


_SUBTYPE = ua.NodeId(ua.ObjectIds.HasSubtype)


def plain(id: Any) -> Any:
    """Return an ExpandedNodeId of this server as a NodeId, and any other value unchanged."""
    if isinstance(id, ua.ExpandedNodeId) and not id.NamespaceUri and not id.ServerIndex:
        return ua.NodeId(id.Identifier, id.NamespaceIndex, id.NodeIdType)
    return id


def is_event_type(aspace: Any, literal: Any) -> bool:
    """Return True if a literal of a filter is the ID of an event type: of BaseEventType or one of its subtypes."""
    id = plain(literal)
    return isinstance(id, ua.NodeId) and id in aspace and _EVENT in supertypes(aspace, id)


_EVENT = ua.NodeId(ua.ObjectIds.BaseEventType)

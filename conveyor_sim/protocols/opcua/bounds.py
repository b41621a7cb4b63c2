# SPDX-License-Identifier: Apache-2.0
"""`Bounds`: the checks of one session's requests against the limits, and the work units that they cost.

`Views` answers Browse, BrowseNext and TranslateBrowsePathsToNodeIds with bounded work. The library answers with all
references at once and has no continuation points. For each reference it walks the tree of reference types again.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import is_dataclass
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.address_space import AddressSpace

from conveyor_sim.protocols.opcua.filter_codes import filter_units
from conveyor_sim.protocols.opcua.items import CHANGE_UNITS, size_of
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.server.quotas import Budget, share_of_guests

Codes = ua.StatusCodes

_REMAINING = ua.Index(4_294_967_295)
"""RemainingPathIndex of a path that was followed to its end (OPC 10000-4, 5.9.4.2)."""


class Views:
    """Browsing of one session, whose requests `WellFormedSession` has checked for their form."""

    def __init__(self, aspace: AddressSpace, limits: OpcUaLimits) -> None:
        """Start without continuation points."""
        self._aspace, self._limits = aspace, limits
        self._points: dict[bytes, tuple[list[ua.ReferenceDescription], int]] = {}
        self.examined = 0
        """References examined so far."""

    def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        """Return the references of each node."""
        asked = params.NodesToBrowse or []
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None] = {}
        results, left = [], self._limits.references_per_answer
        for node in asked:
            result = self._browse(node, kinds)
            left -= self._page(result, result.References, params.RequestedMaxReferencesPerNode, left)
            results.append(result)
        return results

    def browse_next(self, params: ua.BrowseNextParameters) -> list[ua.BrowseResult]:
        """Return the next references of each continuation point, or release it."""
        points = params.ContinuationPoints or []
        results, left = [], self._limits.references_per_answer
        for point in points:
            result = ua.BrowseResult()
            references, most = self._points.pop(point or b"", (None, 0))
            if references is None:
                result.StatusCode = ua.StatusCode(Codes.BadContinuationPointInvalid)
            elif not params.ReleaseContinuationPoints:
                left -= self._page(result, references, most, left)
            results.append(result)
        return results

    def translate(self, paths: Sequence[ua.BrowsePath]) -> list[ua.BrowsePathResult]:
        """Return the targets of each path."""
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None] = {}
        return [self._translate(path, kinds) for path in paths]

    def _page(self, result: ua.BrowseResult, references: list[ua.ReferenceDescription], most: int, left: int) -> int:
        """Put the first references into a result, the others behind a continuation point. Return how many it put in."""
        count = min(most or len(references), len(references), max(left, 0))
        if count < len(references) and len(self._points) >= self._limits.continuation_points:
            result.StatusCode, result.References = ua.StatusCode(Codes.BadNoContinuationPoints), []
            return 0
        result.References = references[:count]
        if count < len(references):
            result.ContinuationPoint = os.urandom(8)
            self._points[result.ContinuationPoint] = references[count:], most
        return count

    def _browse(
        self, asked: ua.BrowseDescription, kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None]
    ) -> ua.BrowseResult:
        result = ua.BrowseResult()
        node = self._aspace.get(asked.NodeId)
        if node is None:
            result.StatusCode = ua.StatusCode(Codes.BadNodeIdUnknown)
        else:
            wanted = self._kinds(asked.ReferenceTypeId, asked.IncludeSubtypes, kinds)
            both = asked.BrowseDirection == ua.BrowseDirection.Both
            forward = asked.BrowseDirection == ua.BrowseDirection.Forward
            self.examined += len(node.references)
            result.References = [
                reference
                for reference in node.references
                if (both or bool(reference.IsForward) == forward)
                and (wanted is None or reference.ReferenceTypeId in wanted)
                and (not asked.NodeClassMask or asked.NodeClassMask & reference.NodeClass)
            ]
        return result

    def _translate(
        self, path: ua.BrowsePath, kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None]
    ) -> ua.BrowsePathResult:
        elements = path.RelativePath.Elements or []
        code = Codes.Good
        nodes: list[ua.NodeId] = [path.StartingNode]
        if len(elements) > self._limits.path_elements:
            code = Codes.BadTooManyOperations
        elif path.StartingNode not in self._aspace:
            code = Codes.BadNodeIdUnknown
        else:
            for element in elements:
                # Each node once, because paths back and forth would multiply.
                nodes = list(dict.fromkeys(self._children(nodes, element, kinds)))
            code = Codes.Good if nodes else Codes.BadNoMatch
        targets = [ua.BrowsePathTarget(node, _REMAINING) for node in nodes] if code == Codes.Good else []
        return ua.BrowsePathResult(ua.StatusCode(code), targets)

    def _children(
        self,
        nodes: Iterable[ua.NodeId],
        element: ua.RelativePathElement,
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None],
    ) -> Iterable[ua.NodeId]:
        wanted = self._kinds(element.ReferenceTypeId, element.IncludeSubtypes, kinds)
        for id in nodes:
            node = self._aspace.get(id)
            for reference in [] if node is None else node.references:
                self.examined += 1
                if (
                    reference.BrowseName == element.TargetName
                    and bool(reference.IsForward) != bool(element.IsInverse)
                    and (wanted is None or reference.ReferenceTypeId in wanted)
                ):
                    yield reference.NodeId

    def _kinds(
        self,
        kind: ua.NodeId,
        subtypes: bool,
        cache: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None],
    ) -> frozenset[ua.NodeId] | None:
        """Return the reference types that a request accepts; None: all. cache: results so far of this request."""
        if kind.is_null():
            return None
        key = kind, bool(subtypes)
        if key not in cache:
            kinds, rest = {kind}, [kind] if subtypes else []
            while rest:
                node = self._aspace.get(rest.pop())
                for reference in [] if node is None else node.references:
                    self.examined += 1
                    if (
                        reference.IsForward
                        and reference.ReferenceTypeId == _HAS_SUBTYPE
                        and reference.NodeId not in kinds
                    ):
                        kinds.add(reference.NodeId)
                        rest.append(reference.NodeId)
            cache[key] = frozenset(kinds)
        return cache[key]


_HAS_SUBTYPE = ua.NodeId(ua.ObjectIds.HasSubtype)


EVENTS_QUEUED = 100
"""Smallest queue size of a monitored item for events."""

_BASE_SIZE = 8
"""Assumed size of a value that is no text, list or structure, bytes."""

_STRUCTURE_SIZE = 1000
"""Assumed size of a structure, bytes. Encoding a structure takes as long as encoding a text of about this size."""

_HISTORY_UNITS = 2
"""Work units of a value of the history."""


class Bounds:
    """Limits of one session."""

    def __init__(self, session: Any, limits: OpcUaLimits) -> None:
        """Start with full budgets. session: an asyncua InternalSession."""
        self._session, self.limits = session, limits
        self.views = Views(session.aspace, limits)
        rate = limits.subscription_units_per_second
        self.subscription_work = Budget(rate, 2 * rate)
        self._units = 0

    @property
    def units(self) -> int:
        """Work units of the session's requests so far, without decoding."""
        return self._units + self.views.examined

    @property
    def is_guest(self) -> bool:
        """True if the session has no user."""
        return not self._session.user.name

    @property
    def party(self) -> str:
        """User of the session, or the address of a session without one."""
        name = self._session.name
        return self._session.user.name or str(name[0] if isinstance(name, tuple) else name)

    def require_answer(self, results: Iterable[ua.DataValue]) -> None:
        """Raise ServiceError with BadResponseTooLarge for values that are too large together."""
        size = sum(_bytes(result.Value.Value) for result in results if result.Value is not None)
        self._units += size // 1000
        if size > self.limits.answer_bytes:
            raise ServiceError(Codes.BadResponseTooLarge)

    def require_subscription(self) -> None:
        """Raise ServiceError with BadTooManySubscriptions if the session may not have one more."""
        self._service.require_room(self._session.session_id, self.party, self.is_guest)

    def require_new_items(self, params: ua.CreateMonitoredItemsParameters) -> None:
        """Raise ServiceError for too many or too costly items. Reduce queues to the room that is left."""
        limits, asked = self.limits, params.ItemsToCreate
        mine = self._items(lambda one: one.session_id == self._session.session_id)
        guests = self._items(lambda one: one.is_guest) if self.is_guest else 0
        if (
            self._items(lambda _: True) + len(asked) > limits.items
            or mine + len(asked) > limits.items_per_session
            or guests + len(asked) > share_of_guests(limits.items)
        ):
            raise ServiceError(Codes.BadTooManyMonitoredItems)
        self._require_cost(asked)

    def require_changed_items(self, params: ua.ModifyMonitoredItemsParameters) -> None:
        """Raise ServiceError for too costly filters of existing items. Reduce queues to the room that is left."""
        subscription = self._service.subscriptions.get(params.SubscriptionId)
        replaced = {
            item.MonitoredItemId
            for item in params.ItemsToModify
            if isinstance(item.RequestedParameters.Filter, ua.EventFilter)
        }
        freed = 0 if subscription is None else subscription.monitored_item_srv.fields_of(replaced)
        self._require_cost(params.ItemsToModify, freed)

    def charge_message(self, message: ua.NotificationMessage) -> None:
        """Add the work for a message that is sent again, by its values and events."""
        self._units += CHANGE_UNITS * sum(map(size_of, message.NotificationData or []))

    def require_history(self, params: ua.HistoryReadParameters) -> None:
        """Limit the values per node to the size of one answer."""
        details = params.HistoryReadDetails
        most = max(1, self.limits.history_values // len(params.NodesToRead))
        details.NumValuesPerNode = min(details.NumValuesPerNode or most, most)
        self._units += _HISTORY_UNITS * most * len(params.NodesToRead)

    def _require_cost(self, asked: Sequence[Any], freed: int = 0) -> None:
        """Raise ServiceError if all event filters of the session together select too much. Reduce queues.

        freed: fields and operands of the filters that are replaced.
        """
        filters = (item.RequestedParameters.Filter for item in asked)
        fields = sum(filter_units(one, self.limits) for one in filters if isinstance(one, ua.EventFilter))
        mine = (
            each.monitored_item_srv.event_fields
            for each in self._service.subscriptions.values()
            if each.session_id == self._session.session_id
        )
        if fields and sum(mine) + fields - freed > self.limits.event_fields_per_session:
            raise ServiceError(Codes.BadTooManyOperations)
        self._bound_queues(asked)

    def _bound_queues(self, asked: Sequence[Any]) -> None:
        """Set queue sizes within the limits.

        The library treats 0 as its longest queue if an item is created, and as an unlimited queue if it is modified.
        """
        subscriptions = self._service.subscriptions.values()
        most = share_of_guests(self.limits.queued) if self.is_guest else self.limits.queued
        left = most - sum(each.monitored_item_srv.queued for each in subscriptions)
        for item in asked:
            wanted = item.RequestedParameters
            least = EVENTS_QUEUED if isinstance(wanted.Filter, ua.EventFilter) else 1
            wanted.QueueSize = max(1, min(max(wanted.QueueSize, least), self.limits.queue_size, left))
            left -= wanted.QueueSize

    def _items(self, wanted: Any) -> int:
        """Return the number of monitored items of all subscriptions for which `wanted` returns True."""
        subscriptions = self._service.subscriptions.values()
        return sum(len(each.monitored_item_srv) for each in subscriptions if wanted(each))

    @property
    def _service(self) -> Any:
        return self._session.subscription_service


def _bytes(value: Any) -> int:
    """Return the approximate size of a value in an answer."""
    if isinstance(value, str | bytes):
        return len(value)
    if isinstance(value, list):
        return sum(map(_bytes, value))
    return _STRUCTURE_SIZE if is_dataclass(value) else _BASE_SIZE

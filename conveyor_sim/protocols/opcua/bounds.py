"""`Bounds`: the checks of one session's requests against the limits, and the work units that they cost."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import is_dataclass
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError

from conveyor_sim.protocols.opcua.browsing import Views
from conveyor_sim.protocols.opcua.filters import filter_units
from conveyor_sim.protocols.opcua.items import CHANGE_UNITS, size_of
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.server.budget import Budget
from conveyor_sim.protocols.server.quotas import share_of_guests

Codes = ua.StatusCodes

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
        """Set queue sizes within the limits. The library treats 0 as the longest queue, or as no bound."""
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

# SPDX-License-Identifier: Apache-2.0
"""`Items`: monitored items of a subscription, with dead bands that hold back only small changes."""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from contextlib import suppress
from typing import Any

from asyncua import ua

from conveyor_sim.protocols.opcua.asyncua_internals import OpenItems
from conveyor_sim.protocols.opcua.filter_codes import filter_code, filter_units
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.where_clause import WhereClause

CHANGE_UNITS, FIELD_UNITS = 4, 2
"""Work units of a change of a value, and of each field or operand of an event."""

_AT_ONCE = 100
"""Number of items that are created or resent before other tasks run."""


class Items(OpenItems):
    """Monitored items of one subscription.

    The library compares a value with the one before it, not with the last one that was sent. So a dead band hides a
    ramp for ever, and changes of the status as well. It also subtracts values that are no numbers.
    """

    def __init__(self, subscription: Any, aspace: Any, limits: OpcUaLimits) -> None:
        """Start without items."""
        super().__init__(subscription, aspace)
        self._limits = limits
        self._units: dict[int, int] = {}
        self._names: dict[int, list[str]] = {}
        self.event_units = self.event_fields = self.queued = 0
        """Work units of one event, fields and operands of all event filters, and room in all queues."""

    def __len__(self) -> int:
        return len(self.by_id)

    def fields_of(self, ids: Collection[int]) -> int:
        """Return the fields and operands of the event filters of some items; ids without an item count 0."""
        return sum(self._units.get(id, 0) for id in ids) // FIELD_UNITS

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Create items a few at a time, between which other tasks run."""
        results: list[ua.MonitoredItemCreateResult] = []
        asked = params.ItemsToCreate
        for first in range(0, len(asked), _AT_ONCE):
            part = ua.CreateMonitoredItemsParameters(ItemsToCreate=asked[first : first + _AT_ONCE])
            results += await super().create_monitored_items(part)
            await asyncio.sleep(0)
        return results

    async def datachange_callback(self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None) -> None:
        """Queue a value if it has changed enough. It is not copied, because a DataValue is never modified."""
        if error is not None:
            await self.trigger_statuschange(error)
            return
        id = self.ids_by_handle.get(handle)
        item = None if id is None else self.by_id.get(id)
        if id is None or item is None or item.mode == ua.MonitoringMode.Disabled or not self.isub.spend(CHANGE_UNITS):
            return
        last = item.mvalue.current_dvalue  # the last value sent, not one that the filter held back
        if item.filter and last is not None and not _exceeds(last, value, item.filter):
            return
        item.mvalue.old_dvalue, item.mvalue.current_dvalue = last, value
        trigger = item.filter.Trigger if item.filter else ua.DataChangeTrigger.StatusValue
        if self.is_changed(item.mvalue, trigger):
            notification = ua.MonitoredItemNotification(item.client_handle, value)
            await self.isub.enqueue_datachange_event(id, notification, item.queue_size)

    async def resend(self) -> None:
        """Queue the present value of each item once more, for a session that takes over (OPC 10000-4, 5.14.7).

        Each value costs as many work units as a change. Other tasks run in between.
        """
        for place, mid in enumerate(list(self.ids_by_handle.values())):
            item = self.by_id.get(mid)
            if item is None or item.mode != ua.MonitoringMode.Reporting or item.read_value_id is None:
                continue
            if not self.isub.spend(CHANGE_UNITS):
                return
            value = self.aspace.read_attribute_value(item.read_value_id.NodeId, item.read_value_id.AttributeId)
            notification = ua.MonitoredItemNotification(item.client_handle, value)
            await self.isub.enqueue_datachange_event(mid, notification, item.queue_size)
            if place % _AT_ONCE == _AT_ONCE - 1:
                await asyncio.sleep(0)

    async def notify(self, event: Any, mid: int) -> None:
        """Queue an event for an item, if the work budget allows it."""
        item = self.by_id.get(mid)
        if item is None or item.mode == ua.MonitoringMode.Disabled or not self.isub.spend(self._units[mid]):
            return
        with suppress(Exception):  # invalid fields of one client do not affect others
            if item.where_clause_evaluator is None or item.where_clause_evaluator.eval(event):
                fields = ua.EventFieldList(item.client_handle, _fields(event, self._names[mid]))
                await self.isub.enqueue_event(mid, fields, item.queue_size)

    def commit(self, result: ua.MonitoredItemCreateResult, item: Any) -> None:
        """Register a new item and count it."""
        super().commit(result, item)
        if result.MonitoredItemId in self.by_id:
            if item.where_clause_evaluator is not None:
                item.where_clause_evaluator = WhereClause(self.logger, self.aspace, item.filter.WhereClause)
            self._count(item, 1)

    def modify(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        """Change an item and its event filter; the library would keep evaluating the old filter."""
        item = self.by_id.get(params.MonitoredItemId)
        if item is None:
            return ua.MonitoredItemModifyResult(ua.StatusCode(ua.StatusCodes.BadMonitoredItemIdInvalid))
        asked, of_events = params.RequestedParameters, item.callback_handle is None
        wanted: Any = asked.Filter or (item.filter if of_events else None)
        if (code := filter_code(wanted, self.aspace if of_events else None)) != ua.StatusCodes.Good:
            return ua.MonitoredItemModifyResult(ua.StatusCode(code))
        self._count(item, -1)
        item.filter, item.queue_size, item.client_handle = wanted, asked.QueueSize, asked.ClientHandle
        if of_events:
            item.where_clause_evaluator = WhereClause(self.logger, self.aspace, wanted.WhereClause)
        self._count(item, 1)
        return ua.MonitoredItemModifyResult(ua.StatusCode(), asked.SamplingInterval, asked.QueueSize)

    def delete(self, mid: int) -> ua.StatusCode:
        """Delete one item. The library searches all items of the subscription for it."""
        item = self.by_id.pop(mid, None)
        if item is None:
            return ua.StatusCode(ua.StatusCodes.BadMonitoredItemIdInvalid)
        self._count(item, -1)
        if item.callback_handle is not None:
            self.aspace.delete_datachange_callback(item.callback_handle)
            self.ids_by_handle.pop(item.callback_handle, None)
            return ua.StatusCode()
        node = item.read_value_id.NodeId
        same = self.ids_by_node.get(node, [])
        if mid in same:
            same.remove(mid)
        if not same:
            self.ids_by_node.pop(node, None)
        return ua.StatusCode()

    def _count(self, item: Any, sign: int) -> None:
        """Add an item to the totals, or take it out of them (sign: 1 or -1)."""
        fields = 0
        if isinstance(item.filter, ua.EventFilter):
            fields = 1 + filter_units(item.filter, self._limits)
            self._names[item.monitored_item_id] = [_name(clause) for clause in item.filter.SelectClauses or []]
        self._units[item.monitored_item_id] = FIELD_UNITS * fields
        if sign < 0:
            del self._units[item.monitored_item_id]
            self._names.pop(item.monitored_item_id, None)
        self.event_fields += sign * fields
        self.event_units += sign * FIELD_UNITS * fields
        self.queued += sign * item.queue_size


def size_of(notification: Any) -> int:
    """Return the number of values or events in a notification."""
    return len(getattr(notification, "MonitoredItems", None) or getattr(notification, "Events", None) or [])


def _name(clause: ua.SimpleAttributeOperand) -> str:
    """Return the name of a field in the library's events, such as "ActiveState/Id" or "NodeId"; "" for no field."""
    if clause.BrowsePath:
        return "/".join(part.Name or "" for part in clause.BrowsePath)
    try:
        return ua.AttributeIds(clause.AttributeId).name
    except ValueError:
        return ""


def _fields(event: Any, names: list[str]) -> list[ua.Variant]:
    """Return fields of an event, null where it has none. They are made once for all items.

    The library copies each value for each item, which takes most of the time of an event.
    """
    made: dict[str, ua.Variant] = getattr(event, "made_fields", {})
    fields = []
    for name in names:
        if name not in made:
            value = getattr(event, name, None) if name in event.data_types else None
            made[name] = ua.Variant() if value is None else ua.Variant(value, event.data_types[name])
        fields.append(made[name])
    return fields


def _exceeds(old: ua.DataValue, new: ua.DataValue, band: ua.DataChangeFilter) -> bool:
    """Return True if a change exceeds an absolute dead band, or there is none (OPC 10000-4, 7.22.2)."""
    if band.DeadbandType != ua.DeadbandType.Absolute or old.StatusCode != new.StatusCode:
        return True
    before, now = (None if each.Value is None else each.Value.Value for each in (old, new))
    if not (isinstance(before, int | float) and isinstance(now, int | float)) or isinstance(now, bool):
        return True
    return not abs(now - before) <= band.DeadbandValue  # NaN exceeds it

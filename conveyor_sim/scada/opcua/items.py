"""`Items`: the monitored items of a subscription, with dead bands that hold back what is small and nothing else."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from asyncua import ua
from asyncua.server.monitored_item_service import MonitoredItemService, MonitoredItemValues, WhereClauseEvaluator

from conveyor_sim.scada.opcua.filter_codes import filter_code


class Items(MonitoredItemService):
    """The library's compares a value with the one before it, not with the one that was sent last: by that a dead band
    hides a ramp for ever, and a change of status too. And of what is no number it takes the difference all the same.
    """

    async def datachange_callback(self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None) -> None:
        """A variable has a value."""
        item = self._monitored_items[self._monitored_datachange[handle]]
        last = item.mvalue.get_current_datavalue()  # that was sent: what is held back does not get there
        if error is None and item.filter and last is not None and not _exceeds(last, value, item.filter):
            return
        await super().datachange_callback(handle, value, error)

    async def resend(self) -> None:
        """Queue the present value of each item once more, for a session that takes over (OPC 10000-4, 5.14.7)."""
        for mid in self._monitored_datachange.values():
            item = self._monitored_items[mid]
            if item.mode == ua.MonitoringMode.Reporting and item.read_value_id is not None:
                value = self.aspace.read_attribute_value(item.read_value_id.NodeId, item.read_value_id.AttributeId)
                notification = ua.MonitoredItemNotification(item.client_handle, value)
                await self.isub.enqueue_datachange_event(mid, notification, item.queue_size)

    def _modify_monitored_item(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        """Change an item, its event filter included, which the library would go on evaluating as it was before."""
        item = self._monitored_items.get(params.MonitoredItemId)
        if item is None:
            return ua.MonitoredItemModifyResult(ua.StatusCode(ua.StatusCodes.BadMonitoredItemIdInvalid))
        of_events = item.callback_handle is None
        wanted: Any = params.RequestedParameters.Filter or (item.filter if of_events else None)
        if (code := filter_code(wanted, of_events=of_events)) != ua.StatusCodes.Good:
            return ua.MonitoredItemModifyResult(ua.StatusCode(code))
        params.RequestedParameters.Filter = wanted
        if of_events:
            item.where_clause_evaluator = WhereClauseEvaluator(self.logger, self.aspace, wanted.WhereClause)
        item.client_handle = params.RequestedParameters.ClientHandle
        return super()._modify_monitored_item(params)

    async def _trigger_event(self, event: Any, mid: int) -> None:
        with suppress(Exception):  # of one client's fields that can't be; to the others it goes all the same
            await super()._trigger_event(event, mid)

    def _is_deadband_exceeded(self, values: MonitoredItemValues, flt: ua.DataChangeFilter) -> bool:
        old, new = values.get_old_datavalue(), values.get_current_datavalue()
        return old is None or new is None or _exceeds(old, new, flt)


def _exceeds(old: ua.DataValue, new: ua.DataValue, band: ua.DataChangeFilter) -> bool:
    """Whether a change is beyond a dead band, if there is an absolute one (OPC 10000-4, 7.22.2)."""
    if band.DeadbandType != ua.DeadbandType.Absolute or old.StatusCode != new.StatusCode:
        return True
    before, now = (None if each.Value is None else each.Value.Value for each in (old, new))
    if not (isinstance(before, int | float) and isinstance(now, int | float)) or isinstance(now, bool):
        return True
    return not abs(now - before) <= band.DeadbandValue  # NaN is beyond, too

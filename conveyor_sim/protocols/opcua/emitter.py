"""`Emitter`: sends events to clients that subscribed to the Server object, and stores conditions for a refresh."""

from __future__ import annotations

import asyncio
import time
from datetime import datetime, timezone
from typing import Any

from asyncua import ua
from asyncua.server.internal_server import InternalServer

_AT_ONCE = 2000
"""Work units of an event after which other tasks run."""


class Emitter:
    """Emitter of one server. All events come from the Server object, because its subscribers do not receive events of
    other nodes.
    """

    def __init__(self, server: InternalServer) -> None:
        self._service = server.subscription_service
        self.session = server.isession

    @property
    def heard(self) -> bool:
        """True if there are subscriptions."""
        return bool(self._service.subscriptions)

    async def emit(self, event: Any, at: datetime) -> None:
        """Send an event. at: its time."""
        event.emitting_node = ua.NodeId(ua.ObjectIds.Server)
        event.Time, event.ReceiveTime = at, datetime.now(timezone.utc)
        event.LocalTime = ua.TimeZoneDataType(time.localtime().tm_gmtoff // 60, bool(time.localtime().tm_isdst))
        condition = getattr(event, "NodeId", None)
        if condition is not None:
            if event.Retain:
                self._service.conditions[condition] = event
            else:
                self.forget(condition)
        event.made_fields = {}
        units = 0
        for subscription in list(self._service.subscriptions.values()):
            await subscription.monitored_item_srv.trigger_event(event)
            units += subscription.monitored_item_srv.event_units
            if units > _AT_ONCE:
                units = 0
                await asyncio.sleep(0)

    def forget(self, condition: ua.NodeId) -> None:
        """Leave a condition out of later refreshes."""
        self._service.conditions.pop(condition, None)

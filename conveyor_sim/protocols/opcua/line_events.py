"""`Emitter`: sends OPC UA events to clients. `LineEvents`: events of a line as OPC UA events, except alarms."""

from __future__ import annotations

import asyncio
import copy
import time
from datetime import datetime, timezone
from typing import Any
from uuid import uuid4

from asyncua import Node, ua
from asyncua.common.events import get_event_obj_from_type_node
from asyncua.server.internal_server import InternalServer

from conveyor_sim.columns.events import Event
from conveyor_sim.protocols.opcua.nodes import LINE, Nodes, node_id
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider, TickClock

_AT_ONCE = 2000
"""Work units of an event after which other tasks run."""


class Emitter:
    """Sends events to clients that subscribed to the Server object, and stores conditions for a refresh.

    All events come from the Server object, because its subscribers do not receive events of other nodes.
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


TYPE = "LineEventType"

FIELDS = (
    ("Kind", ua.VariantType.String),
    ("Name", ua.VariantType.String),
    ("Value", ua.VariantType.Double),
    ("Bottle", ua.VariantType.Int64),
    ("Tick", ua.VariantType.Int64),
)
"""Fields of the event type, as in conveyor_msgs/Events."""

_BOTTLES, _STATES, _HANDS, _WRONG = 1, 100, 300, 500

SEVERITIES = {
    "bottle_fed": _BOTTLES,
    "bottle_removed": _BOTTLES,
    "bottle_rejected": _BOTTLES,
    "machine_state": _STATES,
    "mode_changed": _HANDS,
    "owner_changed": _HANDS,
    "signal_forced": _HANDS,
    "signal_unforced": _HANDS,
}
"""Severity by kind, for filters of clients. All other kinds are errors."""


class LineEvents:
    """Events of one tag provider."""

    def __init__(self, source: TagProvider, nodes: Nodes, emitter: Emitter, clock: TickClock) -> None:
        """Start after the present events."""
        self._source, self._nodes, self._emitter, self._clock = source, nodes, emitter, clock
        self._type = nodes.event_type(TYPE, TYPE, ua.ObjectIds.BaseEventType, FIELDS)
        self._template: Any = None
        self._seen, _ = source.events(0)

    async def follow(self, snapshot: LineSnapshot, heard: datetime, back: bool) -> None:
        """Send new events."""
        total, new = self._source.events(self._seen)
        self._seen = total
        if not self._emitter.heard:
            return
        for happened in new:
            if not happened.kind.startswith("alarm_"):
                await self._emit(happened, self._clock.stamp(happened.at, heard))

    async def _emit(self, happened: Event, at: datetime) -> None:
        if self._template is None:
            self._template = await get_event_obj_from_type_node(Node(self._emitter.session, self._type))
        event = copy.copy(self._template)
        event.EventId = uuid4().bytes
        known = bool(happened.name) and happened.name in self._nodes
        event.SourceNode = node_id(happened.name if known else LINE)
        event.SourceName = happened.name or LINE
        words = f"{happened.kind.replace('_', ' ')}: {happened.name}"
        event.Message = ua.LocalizedText(f"{words}: {happened.text}" if happened.text else words)
        event.Severity = SEVERITIES.get(happened.kind, _WRONG)
        event.Kind, event.Name, event.Value = happened.kind, happened.name, happened.value
        event.Bottle, event.Tick = happened.bottle, happened.at
        await self._emitter.emit(event, at)

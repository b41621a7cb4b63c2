# SPDX-License-Identifier: Apache-2.0
"""OPC UA events. `Emitter` sends them to clients; `LineEvents` has the events of a line, except alarms.

`AlarmStates` has each alarm of a line as an object with variables, and as a condition whose changes are events.
"""

from __future__ import annotations

import asyncio
import copy
import time
from collections.abc import Mapping
from datetime import datetime, timezone
from typing import Any, NamedTuple
from uuid import uuid4

from asyncua import Node, ua
from asyncua.common.events import get_event_obj_from_type_node
from asyncua.server.internal_server import InternalServer

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.events import Event
from conveyor_sim.line.alarms.alarm import CONFIRMED, HIDDEN, NEVER, WAITING, AlarmState
from conveyor_sim.protocols.opcua.dates import Dates
from conveyor_sim.protocols.opcua.methods import ALARM_METHODS, ALARM_STATES, add_alarm_methods
from conveyor_sim.protocols.opcua.nodes import LINE, Nodes, node_id, nothing
from conveyor_sim.protocols.opcua.values import status_of
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
    "bottle_spawned": _BOTTLES,
    "bottle_deleted": _BOTTLES,
    "bottle_rejected": _BOTTLES,
    "machine_state": _STATES,
    "mode_changed": _HANDS,
    "owner_changed": _HANDS,
    "signal_forced": _HANDS,
    "signal_unforced": _HANDS,
}
"""Severity by kind, for filters of clients. All other kinds count as errors."""


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


MOST_OBJECTS = 4000
"""Largest number of alarm objects over time. Alarms beyond it have events, but no object."""

STATE_TEXTS = [state.name.replace("_", " ").capitalize() for state in AlarmState]

_HIDDEN = HIDDEN - {AlarmState.OUT_OF_SERVICE}
_LATCHED = (AlarmState.LATCHED_UNACKNOWLEDGED, AlarmState.LATCHED_ACKNOWLEDGED, AlarmState.LATCHED_UNCONFIRMED)


class _Row(NamedTuple):
    """Values of the variables of one alarm."""

    state: int
    active: bool
    acknowledged: bool
    confirmed: bool
    first_out: bool
    priority: int
    alarm_class: str
    text: str
    tag: str
    group: str
    since: int
    shelved_until: int
    changed_by: str


class _Variable(NamedTuple):
    kind: ua.VariantType
    what: str


_VARIABLES: Mapping[str, _Variable] = {
    "state": _Variable(ua.VariantType.UInt32, "State by ISA-18.2."),
    "active": _Variable(ua.VariantType.Boolean, "True while its condition holds."),
    "acknowledged": _Variable(ua.VariantType.Boolean, "True if it does not wait for an acknowledgement."),
    "confirmed": _Variable(ua.VariantType.Boolean, "True if it does not wait for a confirmation."),
    "first_out": _Variable(ua.VariantType.Boolean, "True if it was the first of its group."),
    "priority": _Variable(ua.VariantType.UInt16, "1 to 1000."),
    "alarm_class": _Variable(ua.VariantType.String, "error, warning or message."),
    "text": _Variable(ua.VariantType.String, "Text of the alarm."),
    "tag": _Variable(ua.VariantType.String, "Signal of the alarm; empty: none."),
    "group": _Variable(ua.VariantType.String, "Group for first-out detection."),
    "since": _Variable(ua.VariantType.DateTime, "Time of the last change of its state."),
    "shelved_until": _Variable(ua.VariantType.DateTime, "Time at which shelving ends; year 1601: none."),
    "changed_by": _Variable(
        ua.VariantType.String, "Writer of the latest operation, such as acknowledge, confirm, shelve or reset."
    ),
}


class AlarmStates:
    """Alarms of one line."""

    def __init__(self, nodes: Nodes, emitter: Emitter, clock: TickClock, tick: float) -> None:
        """Add the object of all alarms. tick: its length, s."""
        self._nodes, self._emitter, self._clock = nodes, emitter, clock
        self._dates = Dates(clock, tick)
        nodes.object(ALARM_STATES, ALARM_STATES, node_id(LINE), "All alarms, each with its state.")
        add_alarm_methods(nodes)
        self._template: Any = None
        self._rows: dict[str, _Row] = {}
        self._objects = 0
        self._columns: AlarmColumns | None = None
        self._status = int(ua.StatusCodes.Good)
        self._event_ids: dict[str, bytes] = {}

    def is_last_event(self, alarm: str, event_id: bytes) -> bool:
        """Return True if an ID is that of the last event of an alarm."""
        return self._event_ids.get(alarm) == event_id

    async def follow(self, snapshot: LineSnapshot, heard: datetime, back: bool) -> None:
        """Write the variables that have changed, and emit events."""
        status = status_of(snapshot)
        every = back or status != self._status
        if snapshot.alarms is None or (snapshot.alarms is self._columns and not every):
            return
        first, self._columns, self._status = self._columns is None, snapshot.alarms, status
        rows = _rows(snapshot.alarms)
        if back:
            self._dates.begin()
        for id in self._rows.keys() - rows.keys():
            await self._write(id, self._rows.pop(id), snapshot, heard, ua.StatusCodes.BadNoData)
            self._emitter.forget(_object(id))
            self._event_ids.pop(id, None)
        for id, row in rows.items():
            before = self._rows.get(id)
            self._rows[id] = row
            if before is None and not self._add(id):
                pass
            elif before != row or every:
                await self._write(id, row, snapshot, heard, status)
            changed = before is None or (before.state, before.active) != (row.state, row.active)
            if changed and not (row.state == AlarmState.NORMAL and (first or before is None)):
                await self._emit(id, row, self._clock.stamp(row.since, heard))

    def _add(self, id: str) -> bool:
        name = f"{ALARM_STATES}/{id}"
        if name in self._nodes:
            return True
        if self._objects >= MOST_OBJECTS:
            return False
        self._objects += 1
        made = self._nodes.object(name, id, node_id(ALARM_STATES), f"The alarm {id}.")
        for field, (kind, what) in _VARIABLES.items():
            is_state = field == "state"
            variable = self._nodes.variable(
                f"{name}/{field}",
                field,
                made,
                ua.Variant(nothing(kind), kind),
                what,
                ua.ObjectIds.MultiStateDiscreteType if is_state else ua.ObjectIds.BaseDataVariableType,
            )
            if is_state:
                texts = [ua.LocalizedText(text) for text in STATE_TEXTS]
                self._nodes.property(
                    f"{name}/{field}/EnumStrings",
                    variable,
                    texts,
                    ua.ObjectIds.LocalizedText,
                    ua.VariantType.LocalizedText,
                )
        for method in ALARM_METHODS:
            target = node_id(f"{ALARM_STATES}/{method}")
            self._nodes.refer(made, target, ua.ObjectIds.HasComponent, ua.NodeClass.Method)
        return True

    async def _write(self, id: str, row: _Row, snapshot: LineSnapshot, heard: datetime, status: int) -> None:
        name, stamp = f"{ALARM_STATES}/{id}", self._clock.stamp(snapshot.tick, heard)
        if name not in self._nodes:
            return
        for field, raw in row._asdict().items():
            value: Any = raw
            if _VARIABLES[field].kind is ua.VariantType.DateTime:
                never = raw == NEVER
                value = nothing(ua.VariantType.DateTime) if never else self._dates.of((id, field), raw, snapshot, heard)
            await self._nodes.write(f"{name}/{field}", ua.Variant(value, _VARIABLES[field].kind), stamp, status)

    async def _emit(self, id: str, row: _Row, at: datetime) -> None:
        """Emit an event of AlarmConditionType (OPC 10000-9, 5.8.2)."""
        if self._template is None:
            kind = Node(self._emitter.session, ua.NodeId(ua.ObjectIds.AlarmConditionType))
            self._template = await get_event_obj_from_type_node(kind)
            self._template.add_property("NodeId", None, ua.VariantType.NodeId)
        event = copy.copy(self._template)
        self._event_ids[id] = event.EventId = uuid4().bytes
        source = node_id(row.tag) if row.tag and row.tag in self._nodes else node_id(LINE)
        event.NodeId, event.SourceNode, event.InputNode = _object(id), source, source
        event.SourceName, event.ConditionName = row.tag or LINE, id
        event.Message, event.Severity, event.LastSeverity = ua.LocalizedText(row.text), row.priority, row.priority
        event.ConditionClassId = ua.NodeId(ua.ObjectIds.ProcessConditionClassType)
        event.ConditionClassName = ua.LocalizedText("ProcessConditionClassType")
        event.BranchId, event.Quality, event.Comment = ua.NodeId(), ua.StatusCode(), ua.LocalizedText("")
        event.ClientUserId = row.changed_by
        event.Retain = row.state not in (AlarmState.NORMAL, AlarmState.OUT_OF_SERVICE)
        event.SuppressedOrShelved = row.state in _HIDDEN
        event.FirstInGroupFlag = row.first_out
        for field, on, true, false in (
            ("EnabledState", True, "Enabled", "Disabled"),
            ("ActiveState", row.active, "Active", "Inactive"),
            ("AckedState", row.acknowledged, "Acknowledged", "Unacknowledged"),
            ("ConfirmedState", row.confirmed, "Confirmed", "Unconfirmed"),
            ("SuppressedState", row.state == AlarmState.SUPPRESSED, "Suppressed", "Unsuppressed"),
            ("OutOfServiceState", row.state == AlarmState.OUT_OF_SERVICE, "Out of Service", "In Service"),
            ("LatchedState", row.state in _LATCHED, "Latched", "Unlatched"),
        ):
            setattr(event, field, ua.LocalizedText(true if on else false, "en"))
            setattr(event, f"{field}/Id", on)
        await self._emitter.emit(event, at)


def _rows(columns: AlarmColumns) -> dict[str, _Row]:
    rows: dict[str, _Row] = {}
    for place, id in enumerate(columns.id):
        state = int(columns.state[place])
        rows[id] = _Row(
            state,
            bool(columns.active[place]),
            state not in WAITING,
            state not in CONFIRMED,
            bool(columns.first_out[place]),
            int(columns.priority[place]),
            columns.alarm_class[place],
            columns.text[place],
            columns.tag[place],
            columns.group[place],
            int(columns.since[place]),
            int(columns.shelved_until[place]),
            columns.changed_by[place],
        )
    return rows


def _object(id: str) -> ua.NodeId:
    return node_id(f"{ALARM_STATES}/{id}")

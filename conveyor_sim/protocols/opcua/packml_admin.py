# SPDX-License-Identifier: Apache-2.0
"""`Admin`: counters, times, stop reason and alarms of a machine: the variables of OPC 30050 that have values in tags.

Types and names are those of the NodeSet (OPC 30050, 6.3.4). Counters and times are never reset separately, so Count and
AccCount are the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from asyncua import Server, ua

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.line.alarms.alarm import WAITING, AlarmState
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.opcua.asyncua_internals import copy_node
from conveyor_sim.protocols.opcua.dates import Dates
from conveyor_sim.protocols.opcua.nodes import NEVER, node_id
from conveyor_sim.protocols.opcua.packml_times import SHAPES, TIMES, LineNews, StateTimes
from conveyor_sim.protocols.opcua.values import unit_of
from conveyor_sim.protocols.tags.tag_provider import LineInfo, LineSnapshot, TickClock

NAME = "Admin"

A_MINUTE = 60.0
"""Seconds per minute: PackML states speeds in packages per minute."""

_TYPE = 5
"""PackMLAdminObjectType."""

_COUNTS: Mapping[str, tuple[str, ...]] = {
    "ProdConsumedCount": ("taken",),
    "ProdProcessedCount": ("produced", "processed"),
    "ProdDefectiveCount": ("defective",),
}
"""Counter tags of a machine by variable, in order of preference."""

_MOST = 2**31 - 1


@dataclass
class PackMLCountDataType:
    """Counter of bottles."""

    ID: ua.Int32
    Name: ua.String
    Unit: ua.EUInformation
    Count: ua.Int32
    AccCount: ua.Int32


@dataclass
class PackMLAlarmDataType:
    """Alarm or stop reason of a machine."""

    ID: ua.Int32
    Value: ua.Int32
    Message: ua.String
    Category: ua.Int32
    DateTime: ua.DateTime
    AckDateTime: ua.DateTime
    Trigger: ua.Boolean


class Admin:
    """Variables of one machine."""

    def __init__(self, machine: str, tags: Mapping[str, Tag], info: LineInfo, clock: TickClock) -> None:
        """Find the tags of the machine. tags: tags of the line by name."""
        self._machine = machine
        self._dates = Dates(clock, info.tick)
        self._times = StateTimes(machine, tags, info.tick)
        self._own = {name for name, tag in tags.items() if tag.device == machine}
        self._reasons = tags[f"{machine}/stop_reason"].texts
        self._design = tags[f"{machine}/rate"].nominal
        self._counts = {
            name: tags[f"{machine}/{counters[0]}"]
            for name, ends in _COUNTS.items()
            if (counters := [end for end in ends if f"{machine}/{end}" in tags])
        }
        self._reason, self._since = 0, NEVER
        self._alarms: AlarmColumns | None = None
        self._began: dict[str, datetime] = {}
        self._rows: dict[str, ua.Variant] = {}

    async def add(self, server: Server, root: str, index: int) -> None:
        """Add its variables below the object of a machine. index: namespace of PackML."""
        for name, encoding, kind in (("Count", 69, PackMLCountDataType), ("Alarm", 74, PackMLAlarmDataType)):
            data_type = ua.NodeId({"Count": 14, "Alarm": 15}[name], index)
            ua.register_extension_object(kind.__name__, ua.NodeId(encoding, index), kind, data_type)
        declared = await server.get_node(ua.NodeId(_TYPE, index)).get_children_descriptions()
        parent, session = node_id(f"{root}.{NAME}"), server.iserver.isession
        wanted = {*self._counts, *TIMES, "StopReason", "Alarm", "AlarmExtent", "Warning", "WarningExtent"}
        wanted |= {"MachDesignSpeed"} if self._design is not None else set()
        for each in declared:
            if each.BrowseName.Name in wanted:
                # Unlike the public function, it keeps the type of reference: HasAlarm and others.
                await copy_node(session, parent, each, node_id(f"{root}.{NAME}.{each.BrowseName.Name}"), False)
        for name, shape in SHAPES.items():
            dimensions = ua.Variant(list(shape), ua.VariantType.UInt32, is_array=True)
            node = server.get_node(node_id(f"{root}.{NAME}.{name}"))
            await node.write_attribute(ua.AttributeIds.ArrayDimensions, ua.DataValue(dimensions))

    def values(self, snapshot: LineSnapshot, heard: datetime, back: bool, news: LineNews) -> dict[str, ua.Variant]:
        """Return the values of the variables by name. back: True if time has stepped back."""
        if back:
            self._reason, self._alarms = 0, None
            self._began.clear()
            self._dates.begin()
        variables = {name: self._count(tag, snapshot.values) for name, tag in self._counts.items()}
        if self._design is not None:
            variables["MachDesignSpeed"] = ua.Variant(self._design * A_MINUTE, ua.VariantType.Float)
        variables["StopReason"] = self._stop_reason(snapshot, heard)
        if snapshot.alarms is not self._alarms and snapshot.alarms is not None:
            self._alarms, self._rows = snapshot.alarms, self._standing(snapshot.alarms, snapshot, heard)
        return variables | self._rows | self._times.values(snapshot, news)

    def _count(self, tag: Tag, values: Mapping[str, float]) -> ua.Variant:
        count = min(_MOST, int(values.get(tag.name, 0.0)))
        return _array([PackMLCountDataType(0, "bottles", unit_of(tag), count, count)])

    def _stop_reason(self, snapshot: LineSnapshot, heard: datetime) -> ua.Variant:
        reason = int(snapshot.values[f"{self._machine}/stop_reason"])
        if reason != self._reason:
            self._reason = reason
            self._since = self._dates.of("stop_reason", snapshot.tick, snapshot, heard) if reason else NEVER
        category = int(snapshot.values[f"{self._machine}/category"])
        text, on = self._reasons.get(reason, ""), category != 0
        made = PackMLAlarmDataType(reason, reason, text, category, self._since, NEVER, on)
        return ua.Variant(made, ua.VariantType.ExtensionObject)

    def _standing(self, columns: AlarmColumns, snapshot: LineSnapshot, heard: datetime) -> dict[str, ua.Variant]:
        """Return the alarms of the machine that are not normal, without those of class message, which PackML lacks.

        DateTime is the date at which an alarm came, and AckDateTime the date of its latest state, once acknowledged.
        """
        rows: dict[str, list[PackMLAlarmDataType]] = {"error": [], "warning": []}
        for place, tag in enumerate(columns.tag):
            id, state, kind = columns.id[place], int(columns.state[place]), columns.alarm_class[place]
            if tag not in self._own or kind not in rows:
                continue
            if state == AlarmState.NORMAL:
                self._began.pop(id, None)
                continue
            since = self._dates.of(id, int(columns.since[place]), snapshot, heard)
            began = self._began.setdefault(id, since)
            if state == AlarmState.UNACKNOWLEDGED and columns.active[place]:
                began = self._began[id] = since
            acknowledged = since if state not in WAITING else NEVER
            text, priority, active = columns.text[place], int(columns.priority[place]), bool(columns.active[place])
            made = PackMLAlarmDataType(place, state, text, priority, began, acknowledged, active)
            rows[kind].append(made)
        variables: dict[str, ua.Variant] = {}
        for name, kind in (("Alarm", "error"), ("Warning", "warning")):
            variables[name] = _array(rows[kind])
            variables[f"{name}Extent"] = ua.Variant(len(rows[kind]), ua.VariantType.Int32)
        return variables


def _array(values: Sequence[object]) -> ua.Variant:
    return ua.Variant(list(values), ua.VariantType.ExtensionObject, is_array=True)

# SPDX-License-Identifier: Apache-2.0
"""`LineMetrics`: tags of a line as metrics of Sparkplug B, and their changes since the last message.

The payload has the field numbers of the specification (3.0, 6.4), and only the parts that a line needs. A metric of
another kind (data set, template, file) decodes without a value.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import datetime
from typing import Any, NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from conveyor_sim.line.run_state import ENDED, PAUSED, STOPPED
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag, count, seconds
from conveyor_sim.protocols.tags.control_mode import is_mode
from conveyor_sim.protocols.tags.handshake import TICK
from conveyor_sim.protocols.tags.tag_provider import LineInfo, LineSnapshot, TickClock
from conveyor_sim.support.rounded_limit import at_limit

INT32, INT64, DOUBLE, BOOLEAN, STRING = 3, 4, 10, 11, 12
"""Data types."""

BAD, GOOD, STALE = 0, 192, 500
"""Values of property QUALITY."""

QUALITY = "Quality"
"""Key of the property with the quality of a value; without it, the quality is good."""

_FIELDS: dict[str, str] = {
    "Payload": "timestamp=1:uint64 metrics=2:Metric* seq=3:uint64 uuid=4:string body=5:bytes",
    "Metric": "name=1:string alias=2:uint64 timestamp=3:uint64 datatype=4:uint32 is_historical=5:bool "
    "is_transient=6:bool is_null=7:bool metadata=8:MetaData properties=9:PropertySet int_value=10:uint32 "
    "long_value=11:uint64 float_value=12:float double_value=13:double boolean_value=14:bool string_value=15:string",
    "MetaData": "description=8:string",
    "PropertySet": "keys=1:string* values=2:PropertyValue*",
    "PropertyValue": "type=1:uint32 is_null=2:bool int_value=3:uint32 long_value=4:uint64 float_value=5:float "
    "double_value=6:double boolean_value=7:bool string_value=8:string",
}
"""Fields by message: name, number and type; * for repeated ones. Fields that end in `_value` exclude each other."""

_PACKAGE = "conveyor_sim.sparkplug"


def _messages() -> dict[str, Any]:
    """Return the class of each message."""
    file = descriptor_pb2.FileDescriptorProto(name="sparkplug_b.proto", package=_PACKAGE, syntax="proto2")
    for message, fields in _FIELDS.items():
        described = file.message_type.add(name=message)
        for field in fields.split():
            name, _, rest = field.partition("=")
            number, _, kind = rest.partition(":")
            added = described.field.add(name=name, number=int(number))
            added.label = added.LABEL_REPEATED if kind.endswith("*") else added.LABEL_OPTIONAL
            kind = kind.rstrip("*")
            if kind in _FIELDS:
                added.type, added.type_name = added.TYPE_MESSAGE, f".{_PACKAGE}.{kind}"
            else:
                added.type = getattr(added, f"TYPE_{kind.upper()}")
            if name.endswith("_value"):
                if not described.oneof_decl:
                    described.oneof_decl.add(name="value")
                added.oneof_index = 0
    pool = descriptor_pool.DescriptorPool()  # a separate pool, because another package may use these names
    pool.Add(file)
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.{name}")) for name in _FIELDS}


Payload: Any = _messages()["Payload"]
"""Class of a payload."""

_VALUES = {INT32: "int_value", INT64: "long_value", DOUBLE: "double_value", BOOLEAN: "boolean_value"}
_BITS = {INT32: 2**32, INT64: 2**64}


def decoded(data: bytes) -> Any:
    """Return a decoded payload. Raises ValueError if it is malformed."""
    try:
        return Payload.FromString(data)
    except (DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{len(data)} bytes that are no payload of Sparkplug B") from error


def add_metric(payload: Any, name: str, kind: int, value: float | str | None, stamp: int) -> Any:
    """Add a metric to a payload and return it. kind: data type; value: None for no value; stamp: ms since 1970, UTC.

    The data type is stated in data messages as well, where it is optional, because some hosts need it.
    """
    metric = payload.metrics.add(name=name, timestamp=stamp, datatype=kind)
    if value is None:
        metric.is_null = True
    else:
        _put(metric, kind, value)
    return metric


def add_property(metric: Any, key: str, kind: int, value: float | str) -> None:
    """Add a property to a metric."""
    metric.properties.keys.append(key)
    _put(metric.properties.values.add(type=kind), kind, value)


def whole(field: str, value: int) -> int:
    """Return the value of an integer field, in which negative numbers are two's complements."""
    bits = 2**32 if field == "int_value" else 2**64
    return value - bits if value >= bits // 2 else value


def _put(owner: Any, kind: int, value: float | str) -> None:
    if kind in _BITS:
        value = int(value) % _BITS[kind]
    setattr(owner, _VALUES.get(kind, "string_value"), bool(value) if kind == BOOLEAN else value)


FORCED = "forced"
"""Key of the property that marks a forced signal; without it, the signal is not forced."""

TIME = "run/time"
"""Metric: simulated time, s."""

_KINDS = {"bool": BOOLEAN, "count": INT64, "enumeration": INT32, "number": DOUBLE}
_TAKEN = {BOOLEAN: ("boolean_value",), DOUBLE: ("double_value", "float_value")}
_WHOLE = ("int_value", "long_value")


class _Reading(NamedTuple):
    value: float | None
    quality: int
    forced: bool


def is_there(snapshot: LineSnapshot) -> bool:
    """Return True if the values of a line are current or paused; otherwise the device is dead."""
    return not snapshot.lost and snapshot.run.state not in (ENDED, STOPPED)


def milliseconds(date: datetime) -> int:
    """Return the milliseconds of a date since 1970, UTC."""
    return int(date.timestamp() * 1e3)


def number_of(tag: Tag, metric: Any) -> float | None:
    """Return the value of a metric for a tag; None if it does not have the tag's type.

    A Double may arrive as a Float, in which a limit has fewer digits.
    """
    kind = _KINDS[tag.kind]
    field = metric.WhichOneof("value")
    if metric.is_null or field not in _TAKEN.get(kind, _WHOLE):
        return None
    value = getattr(metric, field)
    if field == "float_value":
        return at_limit(float(value), tag.low, tag.high)
    return float(whole(field, value) if kind in (INT32, INT64) else value)


class LineMetrics:
    """Metrics of one line, and the values that hosts have received."""

    def __init__(self, info: LineInfo, clock: TickClock, writes: bool) -> None:
        """Prepare the metrics. writes: True if hosts may command."""
        self._tick, self._clock, self._writes = info.tick, clock, writes
        served = [tag for tag in info.tags if tag.role in (*SIGNALS, *COMMANDS)]
        run = [count(TICK, "run", "Ticks since the start."), seconds(TIME, "run", "Simulated time.")]
        self._tags = [*run, *served]
        self._clocks = {TICK, TIME, *(tag.name for tag in served if tag.role == "counter" and tag.unit == "s")}
        self._sent: dict[str, _Reading] = {}

    def birth(self, snapshot: LineSnapshot, heard: datetime) -> Any:
        """Return all metrics with their constant properties, as a payload."""
        payload, stamp = Payload(), milliseconds(self._clock.stamp(snapshot.tick, heard))
        self._sent.clear()
        for tag, reading in self._readings(snapshot):
            metric = self._add(payload, tag, reading, stamp)
            self._describe(metric, tag)
            self._sent[tag.name] = reading
        return payload

    def changes(self, snapshot: LineSnapshot, heard: datetime, passing: bool = True) -> Any:
        """Return the metrics that have changed, as a payload.

        passing: False: return an empty payload if only clocks have changed.
        """
        payload, stamp = Payload(), milliseconds(self._clock.stamp(snapshot.tick, heard))
        changed: list[tuple[Tag, _Reading]] = []
        for tag, reading in self._readings(snapshot):
            if reading != self._sent.get(tag.name):
                changed.append((tag, reading))
        if not passing and all(tag.name in self._clocks for tag, _ in changed):
            return payload
        for tag, reading in changed:
            self._add(payload, tag, reading, stamp)
            self._sent[tag.name] = reading
        return payload

    def _readings(self, snapshot: LineSnapshot) -> Iterator[tuple[Tag, _Reading]]:
        values = {**snapshot.values, TICK: float(snapshot.tick), TIME: snapshot.tick * self._tick}
        quality = STALE if snapshot.run.state == PAUSED else GOOD
        for tag in self._tags:
            value = values.get(tag.name)
            known = value is not None and not math.isnan(value)
            yield tag, _Reading(value if known else None, quality, tag.name in snapshot.forced)

    def _add(self, payload: Any, tag: Tag, reading: _Reading, stamp: int) -> Any:
        metric = add_metric(payload, tag.name, _KINDS[tag.kind], reading.value, stamp)
        before = self._sent.get(tag.name)
        if reading.quality != GOOD or before is None or before.quality != GOOD:
            add_property(metric, QUALITY, INT32, reading.quality)
        if reading.forced or (before is not None and before.forced):
            add_property(metric, FORCED, BOOLEAN, reading.forced)
        return metric

    def _describe(self, metric: Any, tag: Tag) -> None:
        metric.metadata.description = tag.description
        writable = self._writes and (tag.role in COMMANDS or is_mode(tag))
        add_property(metric, "readOnly", BOOLEAN, not writable)
        if tag.kind in ("number", "count"):
            add_property(metric, "engUnit", STRING, "" if tag.unit == "1" else tag.unit)
            add_property(metric, "engLow", DOUBLE, tag.low)
            add_property(metric, "engHigh", DOUBLE, tag.high)
        elif tag.kind == "enumeration":
            add_property(metric, "texts", STRING, tag.listed_texts)

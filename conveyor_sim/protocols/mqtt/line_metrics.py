"""`LineMetrics`: tags of a line as metrics of Sparkplug B, and their changes since the last message."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import datetime
from typing import Any, NamedTuple

from conveyor_sim.line.run_state import ENDED, PAUSED, STOPPED
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag, count, seconds
from conveyor_sim.protocols.mqtt.payload import (
    BOOLEAN,
    DOUBLE,
    GOOD,
    INT32,
    INT64,
    QUALITY,
    STALE,
    STRING,
    Payload,
    add_metric,
    add_property,
    whole,
)
from conveyor_sim.protocols.tags.control_mode import is_mode
from conveyor_sim.protocols.tags.handshake import TICK
from conveyor_sim.protocols.tags.tag_provider import LineInfo, LineSnapshot
from conveyor_sim.protocols.tags.tick_clock import TickClock
from conveyor_sim.support.rounded_limit import at_limit

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

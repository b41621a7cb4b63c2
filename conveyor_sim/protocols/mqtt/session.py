# SPDX-License-Identifier: Apache-2.0
"""`SparkplugSession`: messages of an edge node over one connection: numbered births, data and deaths."""

from __future__ import annotations

import time
from datetime import datetime, timezone
from typing import Any

from conveyor_sim.line.run_state import RUN, STATES
from conveyor_sim.protocols.mqtt.commands import REBIRTH, HostCommands
from conveyor_sim.protocols.mqtt.line_metrics import (
    BOOLEAN,
    INT32,
    INT64,
    STRING,
    LineMetrics,
    Payload,
    add_metric,
    add_property,
    is_there,
    milliseconds,
)
from conveyor_sim.protocols.mqtt.link import BrokerConnection
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot

NAMESPACE = "spBv1.0"
DEVICE = "line"
"""Device of each edge node. There is one device, because the line is commanded, changes and is lost as a whole."""

BETWEEN = 0.1
"""Shortest wall time between two messages of the edge node itself, and before a message in which only clocks have
changed, s.
"""

_NUMBERS = 256


class SparkplugTopics:
    """Topics of an edge node and of its device."""

    def __init__(self, group: str, node: str) -> None:
        """Prepare the topics. group, node: IDs."""
        self.group, self.node = group, node
        self.node_commands, self.line_commands = self.of("NCMD"), self.of("DCMD")

    def of(self, kind: str) -> str:
        """Return the topic of a type of message: NBIRTH, DDATA, ..."""
        topic = f"{NAMESPACE}/{self.group}/{kind}/{self.node}"
        return f"{topic}/{DEVICE}" if kind.startswith("D") else topic


def death(number: int) -> bytes:
    """Return the payload of NDEATH. number: of the connection."""
    payload = Payload(timestamp=_now())
    add_metric(payload, "bdSeq", INT64, number, payload.timestamp)
    return bytes(payload.SerializeToString())


class SparkplugSession:
    """Messages of one connection."""

    def __init__(
        self, link: BrokerConnection, names: SparkplugTopics, number: int, line: LineMetrics, commands: HostCommands
    ) -> None:
        """Start without births. number: number of the connection, which its death has as well."""
        self._link, self._names, self._number, self._line, self._commands = link, names, number, line, commands
        self._next = 0  # sequence number
        self._last: LineSnapshot | None = None
        self._node: dict[str, tuple[int, float | str]] = {}
        self._node_at = 0.0  # s of wall time
        self._alive = False
        self._line_at = 0.0  # wall time of the latest data of the line, s
        self._put_off: tuple[LineSnapshot, datetime] | None = None
        self.born_at: float | None = None
        """Wall time of the latest births, s; None: there were none yet."""

    def bear(self, snapshot: LineSnapshot, heard: datetime) -> None:
        """Send all births, from sequence number 0."""
        self._next, self.born_at = 0, time.monotonic()
        payload, stamp = Payload(), _now()
        add_metric(payload, "bdSeq", INT64, self._number, stamp)
        add_metric(payload, REBIRTH, BOOLEAN, False, stamp)
        self._node = self._of_node(snapshot)
        for name, (kind, value) in self._node.items():
            metric = add_metric(payload, name, kind, value, stamp)
            if kind == INT32:
                add_property(metric, "texts", STRING, ", ".join(f"{number} {text}" for number, text in STATES.items()))
        self._send("NBIRTH", payload)
        self._last, self._alive = snapshot, is_there(snapshot)
        if self._alive:
            self._bear_line(snapshot, heard)

    def bring(self, snapshot: LineSnapshot, heard: datetime) -> None:
        """Send the changes of a line, its death, or its new birth. Call it after `bear`."""
        last, self._last = self._last, snapshot
        back = last is not None and (snapshot.tick < last.tick or snapshot.run_id != last.run_id)
        there = is_there(snapshot)
        if there and (back or not self._alive):
            # After a step back in time, unchanged values would have time stamps in the future.
            self._bear_line(snapshot, heard)
        elif self._alive and not snapshot.lost:
            self._say(snapshot, heard, passing=not there or time.monotonic() >= self._line_at + BETWEEN)
        if self._alive and not there:
            self._send("DDEATH", Payload())
        self._alive = there

    @property
    def behind(self) -> bool:
        """True if changes of clocks wait to be sent."""
        return self._alive and self._put_off is not None

    def catch_up(self) -> None:
        """Send changes of clocks that have waited for BETWEEN."""
        if self.behind and self._put_off is not None and time.monotonic() >= self._line_at + BETWEEN:
            self._say(*self._put_off, passing=True)

    def _say(self, snapshot: LineSnapshot, heard: datetime, passing: bool) -> None:
        changed = self._line.changes(snapshot, heard, passing)
        self._put_off = None if changed.metrics or passing else (snapshot, heard)
        if changed.metrics:
            self._line_at = time.monotonic()
            self._send("DDATA", changed)

    def tell(self, snapshot: LineSnapshot) -> None:
        """Send changes of the edge node itself, unless some were sent within BETWEEN. Call it after `bear`."""
        now, metrics = time.monotonic(), self._of_node(snapshot)
        if metrics == self._node or now < self._node_at + BETWEEN:
            return
        payload, stamp = Payload(), _now()
        for name, (kind, value) in metrics.items():
            if self._node.get(name) != (kind, value):
                add_metric(payload, name, kind, value, stamp)
        self._node, self._node_at = metrics, now
        self._send("NDATA", payload)

    def _bear_line(self, snapshot: LineSnapshot, heard: datetime) -> None:
        self._put_off, self._line_at = None, time.monotonic()
        self._send("DBIRTH", self._line.birth(snapshot, heard))

    def _of_node(self, snapshot: LineSnapshot) -> dict[str, tuple[int, float | str]]:
        """Return the metrics of the edge node. They are always good, because they report the state of the others."""
        commands = self._commands
        written, refused = commands.before
        return {
            f"{RUN}/state": (INT32, snapshot.run.state),
            f"{RUN}/reason": (STRING, snapshot.run.reason),
            f"{RUN}/lost": (STRING, snapshot.lost),
            "commands/written": (INT64, written + commands.writes),
            "commands/refused": (INT64, refused + commands.refused),
            "commands/refusal": (STRING, commands.refusal),
        }

    def _send(self, kind: str, payload: Any) -> None:
        payload.timestamp, payload.seq = _now(), self._next
        self._next = (self._next + 1) % _NUMBERS
        self._link.publish(self._names.of(kind), payload.SerializeToString())


def _now() -> int:
    return milliseconds(datetime.now(timezone.utc))

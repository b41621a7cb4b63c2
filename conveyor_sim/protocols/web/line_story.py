"""`LineStory`: events and slow data of a running line, as a page receives them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from conveyor_sim.columns.events import Event, event_columns
from conveyor_sim.page.story import Story
from conveyor_sim.protocols.tags.line_mirror import DrawableFrame
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot

COUNTERS = 0.5
"""Shortest simulated time between two entries of the counters, s."""


class LineStory(Story):
    """Story of one run from a moment on. It starts with the complete state at that moment."""

    def __init__(self, tick_ns: int) -> None:
        super().__init__(lambda tick: tick * tick_ns * 1e-9, COUNTERS)
        self._seen: dict[str, Any] = {}

    def look(self, snapshot: LineSnapshot, drawable: DrawableFrame, events: Sequence[Event]) -> None:
        """Add events, and what has changed since the last call."""
        latest: dict[str, Any] = {"alarm_states": snapshot.alarms, "readback": snapshot.read_back}
        latest |= {topic: drawable.drawn.get(topic) for topic in ("counters", "rail_wear")}
        new = {topic: what for topic, what in latest.items() if what is not None and what is not self._seen.get(topic)}
        self._seen |= new
        if (columns := event_columns(events, len(events))) is not None:
            self.add("events", columns, snapshot.tick)
        for topic, what in new.items():
            if callable(what):
                what = what()
                self.add(topic, what, int(what.tick))
            else:
                self.add(topic, what, snapshot.tick)

    def _readback(self, message: Any, time: float) -> None:
        """Add the commands with the ticks of their last changes, which may be before the first call."""
        before = len(self.data["readback"])
        super()._readback(message, time)
        rows = self.data["readback"][before:]
        for row in rows:
            row[0] = self._time(int(message.since[row[1]]))
        self.data["readback"][before:] = sorted(rows, key=lambda row: float(row[0]))

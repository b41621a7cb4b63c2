# SPDX-License-Identifier: Apache-2.0
"""Alarms of a recording: for each one its occurrences, the time that it was active, and its state at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple, get_args

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.alarms.alarm import AlarmState
from conveyor_sim.report.alarm_figures import STANDS
from conveyor_sim.report.events import EventRow, chosen_events
from conveyor_sim.report.listing import ListingRow, listing, matches
from conveyor_sim.scene.parts.alarm import AlarmClass
from conveyor_sim.support.printable import SENTENCE, printable

CLASSES: tuple[str, ...] = get_args(AlarmClass)

STATE_NAMES = {state.value: state.name.lower().replace("_", " ") for state in AlarmState}

ENDS = ("alarm_cleared", "alarm_latched", "alarm_suppressed", "alarm_shelved", "alarm_out_of_service")
"""Kinds of events that end the time in which an alarm is active."""


class AlarmRow(NamedTuple):
    """One alarm that occurred, or that is active at the end."""

    id: str
    alarm_class: str
    """error, warning or message; empty if the recording has no topic alarm_states."""
    priority: int | None
    raised: int
    """Number of occurrences in the recording."""
    first: float | None
    """s, simulated, of the first occurrence; None: raised before the recording began."""
    last: float | None
    """s, of the last occurrence."""
    active: float
    """s that the alarm was active, up to the end of the recording."""
    state: str
    """State at the end; empty if the recording has no topic alarm_states."""
    text: str


@dataclass
class _Times:
    """Occurrences of one alarm, s."""

    raised: int = 0
    first: float | None = None
    last: float | None = None
    active: float = 0.0
    since: float | None = None

    def take(self, event: EventRow) -> None:
        if event.kind == "alarm_raised":
            self.raised += 1
            self.first = event.time if self.first is None else self.first
            self.last = event.time
            self.since = event.time if self.since is None else self.since
        elif event.kind in ENDS:
            self.end(event.time)

    def end(self, time: float) -> None:
        if self.since is not None:
            self.active, self.since = self.active + time - self.since, None


def chosen_alarms(path: Path, kinds: Sequence[str] = (), names: Sequence[str] = ()) -> list[AlarmRow]:
    """Return the alarms of a bag that occurred or are active at its end, the highest priority first.

    kinds, names: patterns, one of which must match the class and the ID; empty: all. Raise ConveyorError for a pattern
    that matches no class, BagError for a bag without events.
    """
    for kind in kinds:
        if not any(fnmatchcase(known, kind) for known in CLASSES):
            expected = f"one of {', '.join(CLASSES)}, or a pattern with *"
            raise ConveyorError(f"--kind: {printable(kind)} given, expected {expected}")
    times: dict[str, _Times] = {}
    for event in chosen_events(path, kinds=["alarm_*"]):
        times.setdefault(event.name.removeprefix("alarms/"), _Times()).take(event)
    with open_bag(path) as bag, bag.sense():
        end = 0.0
        states: AlarmColumns | None = None
        for frame in bag.read("alarm_states") if bag.types.get("alarm_states") == TOPICS["alarm_states"].type else ():
            end, states = frame.time, frame.data
        end = max(end, *(_last_time(bag, topic) for topic in ("events", "signals", "bottles")))
        known = {} if states is None else {printable(id): index for index, id in enumerate(states.id)}
        rows = []
        for id in sorted({*times, *(id for id, index in known.items() if states and states.state[index] in STANDS)}):
            rows.append(_row(id, times.get(id, _Times()), end, states, known.get(id)))
    rows = [row for row in rows if matches(row.id, names) and matches(row.alarm_class, kinds)]
    return sorted(rows, key=lambda row: (-(row.priority or 0), -row.raised, row.id))


def _row(id: str, times: _Times, end: float, states: AlarmColumns | None, index: int | None) -> AlarmRow:
    """Return the row of an alarm. end: of the recording, s; states: at the end; index: of the alarm there, if known."""
    times.end(end)
    counts = (times.raised, times.first, times.last, round(times.active, 9))
    if states is None or index is None:
        return AlarmRow(id, "", None, *counts, "", "")
    number = int(states.state[index])
    state = STATE_NAMES.get(number, f"state {number}")
    text = printable(states.text[index], SENTENCE)
    return AlarmRow(id, printable(states.alarm_class[index]), int(states.priority[index]), *counts, state, text)


def _last_time(bag: Bag, topic: str) -> float:
    """Return the time of the last message of a topic, s; 0 without any."""
    ticks = bag.ticks(topic) if bag.types.get(topic) == TOPICS[topic].type else ()
    return bag.time(int(max(ticks, default=0)))


def alarm_listing(rows: Sequence[AlarmRow], width: int | None) -> list[str]:
    """Return the lines for a terminal. width: see `report.listing.listing`."""
    if not rows:
        return ["no such alarm"]
    records = [
        ListingRow(
            (
                row.id,
                row.alarm_class,
                "" if row.priority is None else str(row.priority),
                str(row.raised),
                "" if row.first is None else f"{row.first:.2f}",
                "" if row.last is None else f"{row.last:.2f}",
                f"{row.active:.2f}",
            ),
            f"{row.state}: {row.text}" if row.text and row.state else row.text or row.state,
        )
        for row in rows
    ]
    headings = ("alarm", "class", "priority", "raised", "first, s", "last, s", "active, s", "state at the end: text")
    return listing(headings, records, width, right=range(2, 7))

# SPDX-License-Identifier: Apache-2.0
"""Production of a recorded line, read from its bag."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.forced import forced_signals
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag, Frame, open_bag
from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.errors import BagError
from conveyor_sim.report.alarm_figures import AlarmFigures, AlarmTally
from conveyor_sim.report.command_changes import command_changes
from conveyor_sim.report.commanded_stops import STOP, CommandedStops
from conveyor_sim.report.interval import RATE, counters_within
from conveyor_sim.report.periods import Period
from conveyor_sim.report.span import Times, span_of
from conveyor_sim.support.printable import printable


@dataclass(frozen=True)
class Production:
    """Production of one recording."""

    scene: str
    start: float
    """s, of the first counters."""
    end: float
    """s"""
    counters: CounterColumns
    """The last ones."""
    resets: int
    """Number of resets of the line's counters."""
    periods: Mapping[str, Sequence[Period]]
    """By machine, one after the other from start to end."""
    alarms: AlarmFigures
    time: NDArray[np.float64]
    """(n,), s, of each counters message."""
    good: NDArray[np.float64]
    """(n,), good bottles that had left the line by then, since the start of the recording."""
    forced: Sequence[str] = ()
    """Signals that were forced at any time."""
    remark: str = ""
    """Reason for the start, in words."""


CATEGORY, REASON = "category", "stop_reason"
"""Suffixes of signals whose changes are events, and names of the counter columns with their initial values."""

NO_REASON = "none"
"""Stop reason of a machine that has not stopped yet."""


def read_production(path: Path, times: Times | None = None) -> Production:
    """Read a recording.

    times: that the figures shall cover; None: the recorded counters, since their last reset. Raise BagError for a
    recording without the topics `counters` and `events`, ConveyorError for times outside it.
    """
    with open_bag(path) as bag, bag.sense():
        for topic in ("counters", "events"):
            _require(bag, topic)
        frames = list(bag.read("counters"))
        if not frames:
            raise BagError(
                f"{path}: its topic counters holds no message, expected one at least: "
                "its line counts nothing, or its scene has outputs: {counters: 0}"
            )
        counters, end = frames[-1].data, frames[-1].time
        follower, left = _Follower(frames[0]), list[int]()
        exits = {tag.device for tag in bag.line.tags if tag.device_class in ("sink", "outfeed")}
        raised: list[tuple[float, str, str]] = []
        for frame in bag.read("events"):
            end = max(end, frame.time)
            columns = frame.data
            changes = zip(columns.at, columns.kind, columns.name, columns.text, strict=True)
            for at, kind, name, text in changes:
                raised.append((bag.time(int(at)), kind, printable(name)))
                if kind == "bottle_removed" and name in exits:
                    left.append(int(at))
                if kind == "machine_state":
                    follower.take(bag.time(int(at)), name, printable(text))
        tick, periods = int(bag.line.tick_ns) * 1e-9, follower.finished(end)
        commands = command_changes(bag, [f"{name}/{command}" for name in periods for command in (*STOP, RATE)])
        commanded = CommandedStops(list(periods), commands, bag.time)
        periods = {name: [part for one in of for part in commanded.applied(one)] for name, of in periods.items()}
        span = None
        # Recordings before format 3 keep the figures that they hold, unless times are given.
        if times is not None and (bag.format >= 3 or times != Times()):
            span = span_of(times, frames[0].tick, round(end / tick), left, tick)
            periods = {name: _clipped(of, bag.time(span.start), bag.time(span.stop)) for name, of in periods.items()}
            counters = counters_within(bag, span, frames, periods, commands)
        start, end = (frames[0].time, end) if span is None else (bag.time(span.start), bag.time(span.stop))
        alarms = AlarmTally()
        for event in raised:
            if start <= event[0] <= end:
                alarms.event(*event)
        for frame in bag.read("alarm_states") if bag.types.get("alarm_states") == TOPICS["alarm_states"].type else ():
            if frame.time <= end + 0.5 * tick:
                alarms.states = frame.data
        good, resets = _accumulated(frames)
        time = np.array([frame.time for frame in frames])
        shown = (time >= start) & (time <= end)
        if shown.sum() > 1:  # else the complete series, because a shorter one shows nothing
            time, good = time[shown], good[shown]
        return Production(
            printable(bag.line.scene_name),
            start,
            end,
            counters,
            resets,
            periods,
            alarms.figures(end - start, tick),
            time,
            good,
            forced_signals(bag),
            "" if span is None else span.remark,
        )


def _clipped(periods: Sequence[Period], start: float, stop: float) -> list[Period]:
    """Return the parts of periods between two times, s."""
    parts = [period._replace(begin=max(period.begin, start), end=min(period.end, stop)) for period in periods]
    return [part for part in parts if part.end > part.begin]


def _require(bag: Bag, topic: str) -> None:
    expected, found = TOPICS[topic].type, bag.types.get(topic)
    if found is None:
        raise BagError(
            f"{bag.path}: holds no topic {topic}, expected a recording with it: "
            "this one was made by an earlier version, or with chosen topics"
        )
    if found != expected:
        raise BagError(f"{bag.path}: its topic {topic} is of type {printable(found)}, expected {expected}")


def _accumulated(frames: Sequence[Frame[CounterColumns]]) -> tuple[NDArray[np.float64], int]:
    """Good bottles of the line (n,) as if it had never been reset, and how often it was."""
    made = np.array([float(frame.data.good[-1]) for frame in frames])
    reset = np.diff([int(frame.data.since[-1]) for frame in frames], prepend=int(frames[0].data.since[-1])) != 0
    lost = np.where(reset, np.roll(made, 1), 0.0)
    return made + np.cumsum(lost) - made[0], int(reset.sum())


class _Follower:
    """Makes periods of changes of category and reason."""

    def __init__(self, first: Frame[CounterColumns]) -> None:
        names = zip(first.data.name, first.data.category, first.data.stop_reason, strict=True)
        self._since: dict[str, float] = {}
        self._now: dict[str, dict[str, str]] = {}
        """By machine, the category and the reason."""
        for name, category, reason in names:
            if category:
                self._since[name] = first.time
                self._now[name] = {CATEGORY: printable(category), REASON: printable(reason)}
        self._done: dict[str, list[Period]] = {name: [] for name in self._now}

    def take(self, time: float, signal: str, text: str) -> None:
        """Take a changed signal: at `time` (s), with the new state in `text`."""
        machine, _, which = signal.rpartition("/")
        if which in self._now.get(machine, ()) and time >= self._since[machine]:
            self._end(machine, time)
            self._now[machine][which] = text

    def finished(self, end: float) -> dict[str, list[Period]]:
        """All periods by machine, the last ones up to an end (s)."""
        for machine in self._now:
            self._end(machine, end)
        return self._done

    def _end(self, machine: str, time: float) -> None:
        begin, now = self._since[machine], self._now[machine]
        if time > begin:
            # A machine that runs or waits still shows why it last stood; one that has not been started, no reason.
            reasonless = now[CATEGORY] in ("running", "starved", "blocked") or now[REASON] == NO_REASON
            reason = "" if reasonless else now[REASON]
            done, period = self._done[machine], Period(machine, begin, time, now[CATEGORY], reason)
            if done and done[-1][3:] == period[3:]:  # only the reason of a wait has changed
                period = done.pop()._replace(end=time)
            done.append(period)
            self._since[machine] = time

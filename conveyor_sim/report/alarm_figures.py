# SPDX-License-Identifier: Apache-2.0
"""Alarm statistics of a run: number of alarms, most in ten minutes, and active alarms at the end."""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from conveyor_sim.columns.alarms import AlarmColumns

WINDOW = 600.0
"""s; rates of alarms are given for ten minutes (EEMUA 191, ISA-18.2)."""

FLOOD = 10
"""Alarm flood: more alarms than this in the window are too many for an operator (ISA-18.2)."""

LISTED = 5
"""Alarms that a sentence names."""

STANDS, HIDDEN = (1, 2, 4, 5), (6, 7, 8)
"""States, of `line/alarms/alarm.py`."""


class Listed(NamedTuple):
    """An alarm at the end of a run."""

    id: str
    alarm_class: str
    text: str
    since: float
    """s, of its state."""


@dataclass(frozen=True)
class AlarmFigures:
    """Alarm statistics of a run."""

    raised: int
    per_window: float
    """Mean number of alarms in ten minutes."""
    most_in_window: int
    by_alarm: dict[str, int]
    """Number of occurrences by alarm, the most frequent first."""
    standing: list[Listed]
    """Active alarms at the end, by priority, then the oldest first."""
    hidden: list[Listed]
    """Alarms that were shelved, suppressed or out of service at the end."""

    @property
    def flood(self) -> bool:
        """Return True if there was an alarm flood."""
        return self.most_in_window > FLOOD

    @property
    def any(self) -> bool:
        """Return True if any alarm occurred or is active."""
        return bool(self.raised or self.standing)

    @property
    def lines(self) -> list[str]:
        """Number of alarms with the most frequent ones, then active alarms. Without any of these, no line."""
        often = [f"{times} x {id}" for id, times in self.by_alarm.items()]
        flood = f"; a flood, {self.most_in_window} in ten minutes" if self.flood else ""
        standing = [f"{one.id} since {one.since:g} s" for one in self.standing]
        raised = [f"{self.raised} raised: {_listed(often)}{flood}"] if often else []
        return raised + ([f"active at the end: {_listed(standing)}"] if standing else [])


def _listed(texts: Sequence[str]) -> str:
    more = len(texts) - LISTED
    return ", ".join(texts[:LISTED]) + (f" and {more} more" if more > 0 else "")


@dataclass
class AlarmTally:
    """Counter of alarms over the events of a run in time order."""

    by_alarm: Counter[str] = field(default_factory=Counter)
    most: int = 0
    states: AlarmColumns | None = None
    _recent: deque[float] = field(default_factory=deque)

    def event(self, time: float, kind: str, name: str) -> None:
        """Count one event at `time`, s."""
        if kind != "alarm_raised":
            return
        self.by_alarm[name.removeprefix("alarms/")] += 1
        self._recent.append(time)
        while self._recent[0] <= time - WINDOW:
            self._recent.popleft()
        self.most = max(self.most, len(self._recent))

    def figures(self, seconds: float, tick: float) -> AlarmFigures:
        """Return the statistics of a run of `seconds`. tick: length of a tick, s."""
        raised = self.by_alarm.total()
        return AlarmFigures(
            raised,
            raised * WINDOW / seconds if seconds > 0.0 else 0.0,
            self.most,
            dict(self.by_alarm.most_common()),
            self._listed(STANDS, tick),
            self._listed(HIDDEN, tick),
        )

    def _listed(self, states: tuple[int, ...], tick: float) -> list[Listed]:
        found = self.states
        if found is None:
            return []
        chosen = [index for index, state in enumerate(found.state) if state in states]
        chosen.sort(key=lambda index: (-int(found.priority[index]), int(found.since[index])))
        return [
            Listed(found.id[at], found.alarm_class[at], found.text[at], round(int(found.since[at]) * tick, 9))
            for at in chosen
        ]

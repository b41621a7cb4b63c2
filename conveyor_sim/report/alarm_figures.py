"""What a run's alarms amount to: how many came, how many at most in ten minutes, and what stands at its end."""

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from conveyor_sim.columns.alarms import AlarmColumns

WINDOW = 600.0
"""s; rates of alarms are given for ten minutes (EEMUA 191, ISA-18.2)."""

FLOOD = 10
"""More than so many within the window are a flood: an operator can't follow."""

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
    """What a run's alarms amount to."""

    raised: int
    per_window: float
    """Came in ten minutes, over the whole run."""
    most_in_window: int
    by_alarm: dict[str, int]
    """How often each came, the most frequent first."""
    standing: list[Listed]
    """At the end: the highest priority first, then what has stood longest."""
    hidden: list[Listed]
    """Shelved, suppressed or out of service then."""

    @property
    def flood(self) -> bool:
        """Whether there was one."""
        return self.most_in_window > FLOOD

    @property
    def any(self) -> bool:
        """Whether there is anything to be said."""
        return bool(self.raised or self.standing)

    @property
    def sentence(self) -> str:
        """How many came, the most frequent, and what stands."""
        often = [f"{times} x {id}" for id, times in self.by_alarm.items()]
        came = f"{self.raised} came: {_listed(often)}" if often else "none came"
        flood = f"; a flood, {self.most_in_window} in ten minutes" if self.flood else ""
        standing = [f"{one.id} since {one.since:g} s" for one in self.standing]
        return f"{came}{flood}" + (f"\nstanding at the end: {_listed(standing)}" if standing else "")


def _listed(texts: Sequence[str]) -> str:
    more = len(texts) - LISTED
    return ", ".join(texts[:LISTED]) + (f" and {more} more" if more > 0 else "")


@dataclass
class AlarmTally:
    """Counts alarms while the events of a run go by, in the order of time."""

    by_alarm: Counter[str] = field(default_factory=Counter)
    most: int = 0
    states: AlarmColumns | None = None
    _recent: deque[float] = field(default_factory=deque)

    def event(self, time: float, kind: str, name: str) -> None:
        """One event. time: s."""
        if kind != "alarm_raised":
            return
        self.by_alarm[name.removeprefix("alarms/")] += 1
        self._recent.append(time)
        while self._recent[0] <= time - WINDOW:
            self._recent.popleft()
        self.most = max(self.most, len(self._recent))

    def figures(self, seconds: float, tick: float) -> AlarmFigures:
        """Of a run so long. tick: its length, s."""
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

# SPDX-License-Identifier: Apache-2.0
"""`StateTimes`: simulated time of a machine by control mode and PackML state, for `Admin` (OPC 30050, 6.3.4).

Changes come from the events of the line, which have their exact ticks, also in runs so fast that ticks are not shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from asyncua import ua

from conveyor_sim.columns.events import Event
from conveyor_sim.line.commands.authority import AUTOMATIC, MODES
from conveyor_sim.line.machines.packml import STATE_TEXTS
from conveyor_sim.line.run_state import REPLAYING
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider

MODE_COUNT, STATE_COUNT = max(MODES) + 1, max(STATE_TEXTS) + 1
"""Lengths of the arrays. Their indices are the numbers of UnitModeCurrent and of PackML's StateCurrent."""

TIMES = ("ModeCurrentTime", "ModeCumulativeTime", "StateCurrentTime", "StateCumulativeTime", "AccTimeSinceReset")
"""Variables of `Admin`, s as Int32."""

SHAPES: Mapping[str, tuple[int, ...]] = {
    "ModeCurrentTime": (MODE_COUNT,),
    "ModeCumulativeTime": (MODE_COUNT,),
    "StateCurrentTime": (MODE_COUNT, STATE_COUNT),
    "StateCumulativeTime": (MODE_COUNT, STATE_COUNT),
}
"""Shapes of the arrays."""

_ROLLS_OVER = 2**31 - 1
"""Value at which the times begin at 0 again (OPC 30050, 6.3.4)."""

_JUMP = 10.0
"""Simulated time between two frames of a playback above which the playback has jumped, s."""


class LineNews(NamedTuple):
    """Events that have arrived since the previous snapshot."""

    events: Sequence[Event]
    """Events in order. Some may be later than the snapshot."""
    is_new_run: bool = False
    """True if another run has begun; `events` then has only events of that run."""
    is_incomplete: bool = False
    """True if earlier events are missing, or time has stepped back."""


class NewsReader:
    """Reads the events of a tag provider, snapshot by snapshot."""

    def __init__(self, source: TagProvider) -> None:
        """Start before the first event."""
        self._source = source
        self._seen = 0
        self._run_id: str | None = None

    def read(self, snapshot: LineSnapshot, back: bool) -> LineNews:
        """Return the events since the previous call. back: True if time has stepped back."""
        total, events = self._source.events(self._seen)
        missing, self._seen = total - self._seen > len(events), total
        is_new_run = self._run_id is not None and snapshot.run_id != self._run_id
        self._run_id = snapshot.run_id
        if is_new_run:
            drops = [place for place in range(1, len(events)) if events[place].at < events[place - 1].at]
            return LineNews(events[drops[-1] if drops else 0 :], is_new_run=True)
        return LineNews(events, is_incomplete=missing or back)


class StateTimes:
    """Times of one machine since the start of the run.

    If the server starts later and not all events since the start are available, the times begin at the server's start;
    AccTimeSinceReset is the time since then. They begin again after a reset, and after a jump in a recording.
    """

    def __init__(self, machine: str, tags: Mapping[str, Tag], tick: float) -> None:
        """Start at tick 0. tags: tags of the line by name. tick: its length, s."""
        self._machine, self._length = machine, tick
        self._initial = int(tags[f"{machine}/state"].initial)
        self._shown: tuple[int, ...] = ()
        self._variables: dict[str, ua.Variant] = {}
        self._begin(0, AUTOMATIC, self._initial)

    def _begin(self, tick: int, mode: int, state: int) -> None:
        self._began = self._mode_since = self._since = self._latest = tick
        self._mode, self._state = mode, state
        self._ticks = [[0] * STATE_COUNT for _ in range(MODE_COUNT)]
        self._pending: list[Event] = []

    def values(self, snapshot: LineSnapshot, news: LineNews) -> dict[str, ua.Variant]:
        """Return the variables by name."""
        mode = int(snapshot.values.get(f"{self._machine}/mode", AUTOMATIC))
        state = int(snapshot.values[f"{self._machine}/state"])
        jumped = snapshot.run.state == REPLAYING and (snapshot.tick - self._latest) * self._length > _JUMP
        if news.is_new_run:
            self._begin(0, AUTOMATIC, self._initial)
        elif news.is_incomplete or jumped:
            self._begin(snapshot.tick, mode, state)
        self._latest = snapshot.tick
        self._pending += [event for event in news.events if event.name in (self._machine, f"{self._machine}/state")]
        while self._pending and self._pending[0].at <= snapshot.tick:
            event = self._pending.pop(0)
            if event.kind == "mode_changed":
                self._change(event.at, int(event.value), self._state)
            elif event.kind == "machine_state":
                self._change(event.at, self._mode, int(event.value))
        self._change(snapshot.tick, mode, state)
        return self._variables_at(snapshot.tick)

    def _change(self, tick: int, mode: int, state: int) -> None:
        """Enter a mode and a state at a tick. An event of an earlier run has no effect."""
        known = 0 <= mode < MODE_COUNT and 0 <= state < STATE_COUNT
        if not known or tick < self._since or (mode, state) == (self._mode, self._state):
            return
        self._ticks[self._mode][self._state] += tick - self._since
        if mode != self._mode:
            self._mode_since = tick
        self._mode, self._state, self._since = mode, state, tick

    def _variables_at(self, tick: int) -> dict[str, ua.Variant]:
        before, spent = self._ticks[self._mode], tick - self._since
        shown = (
            self._mode,
            self._state,
            self._seconds(spent),
            self._seconds(before[self._state] + spent),
            self._seconds(tick - self._mode_since),
            self._seconds(sum(before) + spent),
            self._seconds(tick - self._began),
        )
        if shown != self._shown:  # at most once per second and change
            self._shown = shown
            _, _, state, state_sum, mode, mode_sum, since_reset = shown
            states = [[0] * STATE_COUNT for _ in range(MODE_COUNT)]
            states[self._mode][self._state] = state
            sums = [[self._seconds(ticks) for ticks in row] for row in self._ticks]
            sums[self._mode][self._state] = state_sum
            modes = [0] * MODE_COUNT
            modes[self._mode] = mode
            mode_sums = [self._seconds(sum(row)) for row in self._ticks]
            mode_sums[self._mode] = mode_sum
            values = (modes, mode_sums, states, sums, since_reset)
            self._variables = {name: variant(name, value) for name, value in zip(TIMES, values, strict=True)}
        return self._variables

    def _seconds(self, ticks: int) -> int:
        """Return whole seconds. The tolerance is for a length of a tick that is no binary fraction."""
        return int(ticks * self._length + 1e-6) % _ROLLS_OVER


def variant(name: str, value: object) -> ua.Variant:
    """Return a value of one of TIMES."""
    shape = SHAPES.get(name, ())
    return ua.Variant(value, ua.VariantType.Int32, list(shape) if len(shape) > 1 else None, is_array=bool(shape))

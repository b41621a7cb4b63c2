# SPDX-License-Identifier: Apache-2.0
"""Story of a stretch of a recording for the page, as JSON: events, alarms, read-back values, counters.

Every list is in the order of time. States are listed when they change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.columns.alarms import AlarmColumns

TOPICS_READ = ("events", "alarm_states", "readback", "counters", "rail_wear", "run_state")
"""Topics from which a story is collected."""

_DECLARED = ("id", "text", "alarm_class", "priority", "tag", "group", "latching")
_ALARM = ("state", "active", "first_out", "since", "changed_by")
_COUNTED = (
    "processed", "good", "defective", "rejected", "failures",
    "running", "starved", "blocked", "down", "planned", "idle",
    "rate", "availability", "effectiveness", "quality", "oee", "mtbf", "mttr", "category", "stop_reason",
    "rate_limit", "set_effectiveness",
)  # fmt: skip

_WORN = ("scuffing_work", "impulse")
WEAR_EVERY = 5.0
"""Least simulated time between two entries of rail wear, s."""


class Story:
    """Story collected from messages in the order of time."""

    def __init__(self, time: Callable[[int], float], counters_every: float) -> None:
        """time: returns the time of a tick, s. counters_every: least time between two entries of the counters, s."""
        self._time = time
        self._counters_every = counters_every
        self._alarms: dict[int, list[Any]] = {}
        """State of each alarm, by number."""
        self._commands: tuple[NDArray[np.float64], NDArray[np.object_]] | None = None
        """Value and writer of each command."""
        self._counted = -math.inf
        self._worn = -math.inf
        self.data = _empty()

    def take(self) -> dict[str, Any]:
        """Return the story since the last call."""
        data, self.data = self.data, _empty()
        return data

    def add(self, topic: str, message: Any, tick: int) -> None:
        """Add a decoded message of one of TOPICS_READ, or its columns."""
        getattr(self, f"_{topic}")(message, self._time(tick))

    def _events(self, message: Any, _: float) -> None:
        columns = TOPICS["events"].unpack(message)
        events = self.data["events"]
        events["at"] += [round(self._time(int(tick)), 6) for tick in columns.at]
        events["kind"] += list(columns.kind)
        events["name"] += list(columns.name)
        events["bottle"] += columns.bottle.tolist()
        events["value"] += columns.value.tolist()
        events["text"] += list(columns.text)

    def _alarm_states(self, message: Any, time: float) -> None:
        columns = message if isinstance(message, AlarmColumns) else TOPICS["alarm_states"].unpack(message)
        before = self._alarms
        for place, number in enumerate(columns.number.tolist()):
            self.data["alarms"][number] = {name: _plain(getattr(columns, name)[place]) for name in _DECLARED}
            state = [_plain(getattr(columns, name)[place]) for name in _ALARM]
            state[_ALARM.index("since")] = self._time(state[_ALARM.index("since")])
            if before.get(number) != state:
                before[number] = state
                self.data["alarm_changes"].append([time, number, *state])

    def _readback(self, message: Any, time: float) -> None:
        columns = TOPICS["readback"].unpack(message)
        values = np.asarray(columns.value, dtype=np.float64)
        writers = np.array(columns.writers, dtype=object)[columns.writer]
        changed = np.ones(values.size, dtype=np.bool_)
        if self._commands is not None:
            # Equal bits: NaN is no change, and a zero of the other sign is one.
            changed = (values.view(np.int64) != self._commands[0].view(np.int64)) | (writers != self._commands[1])
        self._commands = values, writers
        for place in np.flatnonzero(changed).tolist():
            self.data["readback"].append([time, place, float(values[place]), writers[place]])

    def _counters(self, message: Any, time: float) -> None:
        if time < self._counted + self._counters_every - 1e-9:
            return
        self._counted = time
        rows = [[_plain(getattr(message, name)[place]) for name in _COUNTED] for place in range(len(message.name))]
        names, bottleneck = list(message.name), list(message.bottleneck)
        self.data["counters"].append({"at": time, "name": names, "rows": rows, "bottleneck": bottleneck})

    def _rail_wear(self, message: Any, time: float) -> None:
        if time < self._worn + WEAR_EVERY - 1e-9:
            return
        self._worn = time
        if self.data["bins"] is None:
            places = {name: np.round(getattr(message, name), 4).tolist() for name in ("x", "y", "length")}
            self.data["bins"] = {"rail": message.rail.tolist(), **places}
        scuffing, impulse = ([_short(value) for value in getattr(message, name).tolist()] for name in _WORN)
        self.data["wear"].append([time, scuffing, impulse])

    def _run_state(self, message: Any, time: float) -> None:
        self.data["runs"].append([time, message.text, message.reason])


def _empty() -> dict[str, Any]:
    return {
        "events": {name: [] for name in ("at", "kind", "name", "bottle", "value", "text")},
        "alarms": {},
        "alarm_changes": [],
        "readback": [],
        "counters": [],
        "runs": [],
        "bins": None,
        "wear": [],
    }


def fields() -> Mapping[str, tuple[str, ...]]:
    """Return the names of the fields of rows, by list."""
    return {"counters": _COUNTED, "alarm_changes": ("at", "number", *_ALARM)}


def _short(value: float) -> float:
    """Round a value to the digits that a colour shows."""
    return float(f"{value:.3g}")


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value

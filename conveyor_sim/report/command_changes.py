# SPDX-License-Identifier: Apache-2.0
"""Values of commands over a recording, from the recorded read-back or else from the results of all commands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag
from conveyor_sim.line.commands.inputs import SET


class Change(NamedTuple):
    """New value of a command."""

    tick: int
    """Tick at whose start it took effect."""
    value: float


def command_changes(bag: Bag, commands: Sequence[str]) -> dict[str, list[Change]]:
    """Return the values of some commands in order, each with its tick.

    With a recorded read-back, the first one is the value at the start of the recording. Unknown commands have none.
    """
    changes: dict[str, list[Change]] = {name: [] for name in commands}
    recorded = bag.types.get("readback") == TOPICS["readback"].type
    for name, change in _from_read_back(bag, commands) if recorded else _from_results(bag, changes):
        if not changes[name] or changes[name][-1].value != change.value:
            changes[name].append(change)
    return changes


def _from_read_back(bag: Bag, commands: Sequence[str]) -> Iterator[tuple[str, Change]]:
    """Yield the changed values. Controllers repeat commands in each scan, but their read-back changes rarely."""
    index = {name: place for place, name in enumerate(bag.line.command_names)}
    known = [name for name in commands if name in index]
    places = np.array([index[name] for name in known], dtype=np.intp)
    before = np.full(len(known), np.nan)
    for frame in bag.read("readback") if known else ():
        values = frame.data.value[places]
        for row in np.flatnonzero(values != before).tolist():
            yield known[row], Change(int(frame.data.since[places[row]]), float(values[row]))
        before = values


def _from_results(bag: Bag, commands: Mapping[str, object]) -> Iterator[tuple[str, Change]]:
    for frame in bag.outcomes():
        if frame.data.accepted and frame.data.operation == SET:
            for name, value in zip(frame.data.names, frame.data.values, strict=True):
                if name in commands:
                    yield name, Change(frame.tick, float(value))

# SPDX-License-Identifier: Apache-2.0
"""`ReadBack`: present value of each command, with its writer and the time of the last change."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.tag import Tag

SCENE = ("scene", "line")
"""Writer of the values at the start of a run."""


class ReadBack:
    """One entry per command. Public attributes are stored in checkpoints."""

    values: list[float]
    since: list[int]
    """Ticks of the last changes. Repeating the same value by the same writer is no change."""
    writers: list[tuple[str, str]]
    """Names and kinds of the writers."""

    def __init__(self, commands: Sequence[Tag]) -> None:
        """Start with the scene's initial values."""
        self._index = {command.name: place for place, command in enumerate(commands)}
        self.values = [float(command.initial) for command in commands]
        self.since = [0] * len(commands)
        self.writers = [SCENE] * len(commands)
        self._changed = True

    def begin(self) -> None:
        """Start a tick without changes."""
        self._changed = False

    def restored(self, tick: int) -> None:
        """Check the restored attributes and report them as changed. Raise ValueError if they do not fit the line."""
        commands = len(self._index)
        if not len(self.values) == len(self.since) == len(self.writers) == commands:
            raise ValueError(f"line.read_back has another number of commands than the {commands} of the scene")
        if not all(0 <= since <= tick for since in self.since):
            raise ValueError(f"line.read_back.since is not from 0 to {tick}")
        self._changed = True

    def note(self, request: Input, tick: int) -> None:
        """Record commands that were accepted or that the line has set."""
        by = (request.writer, request.writer_kind)
        for name, value in zip(request.names, request.values, strict=True):
            place = self._index.get(name)
            if place is not None and (self.values[place] != value or self.writers[place] != by):
                self.values[place], self.writers[place], self.since[place] = value, by, tick
                self._changed = True

    def changes(self) -> ReadBackColumns | None:
        """Return all entries if any changed in the last tick, else None."""
        return self.columns() if self._changed and self.values else None

    def columns(self) -> ReadBackColumns:
        """Return all entries."""
        number = {by: place for place, by in enumerate(dict.fromkeys([SCENE, *map(tuple, self.writers)]))}
        names, kinds = zip(*number, strict=True)
        return ReadBackColumns(
            value=np.array(self.values, dtype=np.float64),
            since=np.array(self.since, dtype=np.uint64),
            writer=np.array([number[by] for by in self.writers], dtype=np.uint16),
            writers=names,
            writer_kinds=kinds,
        )

# SPDX-License-Identifier: Apache-2.0
"""`ReadBack`: present value of each command, with its writer and the time of the last change."""

from collections.abc import Collection, Iterable, Sequence

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

    def __init__(self, commands: Sequence[Tag], repeating: Collection[str] = ()) -> None:
        """Start with the scene's initial values.

        repeating: names of commands that may have an effect although they repeat the value of the same writer.
        """
        self._repeating = repeating
        self._index = {command.name: place for place, command in enumerate(commands)}
        self.values = [float(command.initial) for command in commands]
        self.since = [0] * len(commands)
        self.writers = [SCENE] * len(commands)
        self._changed = True
        self._names: tuple[str, ...] = ()
        self._places: list[int | None] = []

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

    def changed(self, request: Input) -> list[tuple[str, float]]:
        """Return the commands, faults and alarms of an input by name, without commands that change nothing."""
        if request.names != self._names:
            self._names = request.names
            self._places = [None if name in self._repeating else self._index.get(name) for name in request.names]
        by, values, writers = (request.writer, request.writer_kind), self.values, self.writers
        commands = zip(request.names, request.values, self._places, strict=True)
        return [
            (name, value)
            for name, value, place in commands
            if place is None or values[place] != value or writers[place] != by
        ]

    def note(self, request: Input, tick: int) -> None:
        """Record commands that were accepted or that the line has set."""
        self.note_values((request.writer, request.writer_kind), zip(request.names, request.values, strict=True), tick)

    def note_values(self, by: tuple[str, str], commands: Iterable[tuple[str, float]], tick: int) -> None:
        """Record commands by name. by: name and kind of their writer."""
        for name, value in commands:
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

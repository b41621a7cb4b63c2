"""`ReadBack`: what each command is set to, and who set it when."""

from collections.abc import Sequence

import numpy as np

from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.tag import Tag

SCENE = ("scene", "line")
"""Whose the values are that a run begins with."""


class ReadBack:
    """One entry for each command. Public attributes are remembered in checkpoints."""

    values: list[float]
    since: list[int]
    """Ticks from which on they have these values from these writers: who gives the same again changes nothing."""
    writers: list[tuple[str, str]]
    """Name and kind."""

    def __init__(self, commands: Sequence[Tag]) -> None:
        """As it is before anybody commands."""
        self._index = {command.name: place for place, command in enumerate(commands)}
        self.values = [float(command.initial) for command in commands]
        self.since = [0] * len(commands)
        self.writers = [SCENE] * len(commands)
        self._changed = True

    def begin(self) -> None:
        """A tick begins."""
        self._changed = False

    def restored(self, tick: int) -> None:
        """Check the restored attributes and report them as changed. Raise ValueError if they do not fit the line."""
        commands = len(self._index)
        if not len(self.values) == len(self.since) == len(self.writers) == commands:
            raise ValueError(f"line.read_back has other commands than the {commands} of the scene")
        if not all(0 <= since <= tick for since in self.since):
            raise ValueError(f"line.read_back.since is not from 0 to {tick}")
        self._changed = True

    def note(self, given: Input, tick: int) -> None:
        """Commands were accepted, or the line has set them."""
        by = (given.writer, given.writer_kind)
        for name, value in zip(given.names, given.values, strict=True):
            place = self._index.get(name)
            if place is not None and (self.values[place] != value or self.writers[place] != by):
                self.values[place], self.writers[place], self.since[place] = value, by, tick
                self._changed = True

    def changes(self) -> ReadBackColumns | None:
        """As it is now, if it has changed in the last tick; None: it has not."""
        return self.columns() if self._changed and self.values else None

    def columns(self) -> ReadBackColumns:
        """As it is now."""
        number = {by: place for place, by in enumerate(dict.fromkeys([SCENE, *map(tuple, self.writers)]))}
        names, kinds = zip(*number, strict=True)
        return ReadBackColumns(
            value=np.array(self.values, dtype=np.float64),
            since=np.array(self.since, dtype=np.uint64),
            writer=np.array([number[by] for by in self.writers], dtype=np.uint16),
            writers=names,
            writer_kinds=kinds,
        )

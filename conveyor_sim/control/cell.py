# SPDX-License-Identifier: Apache-2.0
"""`in_cell`: a controller written for a file, applied to a cell of a scene that uses the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.scan import PROGRAM, ControlError, Controller, Inputs, LineTags, bind, declared_alarms


def in_cell(controller: Controller, cell: str) -> Controller:
    """Return a controller of one cell of a scene.

    controller: names tags as if the file of the cell were the scene: `belts/lane/speed`. cell: name of the cell; its
    lane is `belts/<cell>_lane/speed` in the scene. Only tags of the cell are visible to the controller. Alarms and
    variables get the prefix too, so `together` accepts the same controller for several cells. Its `bind` raises
    ControlError if the line has no such cell.
    """
    return _InCell(controller, f"{cell}_")


class _InCell:
    def __init__(self, controller: Controller, prefix: str) -> None:
        self._controller = controller
        self._prefix = prefix
        self._outside: dict[str, str] = {}  # a line has thousands of tags, and a scan reads some hundreds by name

    def bind(self, tags: LineTags) -> None:
        """Pass the tags of the cell on. Raise ControlError if the line has none."""
        if not self._of_cell(tags.signals):
            raise ControlError(f"cell {self._prefix[:-1]}: no signal of this line has the prefix {self._prefix}")
        bind(self._controller, LineTags(*map(self._of_cell, (tags.signals, tags.commands, tags.limits))))

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        return tuple(self._alarm(alarm) for alarm in declared_alarms(self._controller))

    @property
    def alarm_tags(self) -> tuple[str, ...]:
        """Tags of the controller's alarms, named as in the scene."""
        return tuple(map(self.outside, getattr(self._controller, "alarm_tags", ())))

    @property
    def variables(self) -> Mapping[str, float]:
        """Variables of the controller by name."""
        return {self._variable(name): value for name, value in getattr(self._controller, "variables", {}).items()}

    @property
    def record(self) -> tuple[str, ...]:
        """Patterns of the controller."""
        return tuple(map(self._variable, getattr(self._controller, "record", ())))

    @property
    def left_over(self) -> tuple[str, ...]:
        """Sentences of the controller."""
        return tuple(getattr(self._controller, "left_over", ()))

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        own = Inputs(_Image(self, inputs), inputs.time, inputs.tick, inputs.length)
        return {self.outside(name): value for name, value in self._controller.scan(own).items()}

    def outside(self, name: str) -> str:
        """Return the name in the scene of a tag or an alarm of the cell."""
        found = self._outside.get(name)
        if found is None:
            kind, slash, rest = name.partition("/")
            found = self._outside[name] = f"{kind}/{self._prefix}{rest}" if slash else self._prefix + name
        return found

    def inside(self, name: str) -> str | None:
        """Return the name in the cell of a tag of the scene; None if it belongs to another part of the scene."""
        kind, _, rest = name.partition("/")
        return f"{kind}/{rest[len(self._prefix) :]}" if rest.startswith(self._prefix) else None

    def _variable(self, name: str) -> str:
        return f"{PROGRAM}{self._prefix}{name[len(PROGRAM) :]}" if name.startswith(PROGRAM) else self._prefix + name

    def _of_cell(self, tags: Mapping[str, Any]) -> dict[str, Any]:
        named = ((self.inside(name), value) for name, value in tags.items())
        return {name: value for name, value in named if name is not None}

    def _alarm(self, alarm: Alarm) -> Alarm:
        causes = tuple(map(self.outside, alarm.suppressed_by))
        tag = alarm.tag and self.outside(alarm.tag)
        group = alarm.group and self.outside(alarm.group)
        return replace(alarm, id=self.outside(alarm.id), tag=tag, suppressed_by=causes, group=group)


class _Image(Mapping[str, float]):
    """Values of a cell's signals by their names in the cell."""

    def __init__(self, cell: _InCell, inputs: Inputs) -> None:
        self._cell = cell
        self._inputs = inputs

    def __getitem__(self, name: str) -> float:
        return self._inputs[self._cell.outside(name)]

    def __iter__(self) -> Iterator[str]:
        return (name for name in map(self._cell.inside, self._inputs) if name is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)

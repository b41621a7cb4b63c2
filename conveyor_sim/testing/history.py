"""`History`: what every signal, command, fault and alarm was at every tick of a scenario, as arrays."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.control.scan import ALARMS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import FORCE, INJECT, MODE, SET, UNFORCE, CommandOutcome
from conveyor_sim.line.process_image import ProcessImage
from conveyor_sim.line.tag import Kind

F8 = NDArray[np.float64]

_FIRST_ROWS = 1024

_MARKED = {MODE: "mode", FORCE: "forced", UNFORCE: "unforced"}
"""What is marked of operations that give no commands."""


@dataclass(frozen=True)
class Mark:
    """What was done to the line from outside its controller, or went wrong with it."""

    time: float
    """s"""
    name: str
    value: float
    """NaN: none."""


class History:
    """Columns by name, one entry a tick from the scenario's first to its present one, or the last ones of them.

    A signal is what it was at the tick. A command is what was in force from the tick on, NaN until it was first given;
    a fault likewise, 0 until it was first injected. An alarm ("alarms/<name>") is 1 while it stood.
    """

    def __init__(self, image: ProcessImage, most: int | None = None) -> None:
        """most: ticks to keep, at least one, those before are forgotten; None: all."""
        self._index = {name: column for column, name in enumerate(image.signal_names)}
        entries = (*image.signals, *image.commands, *image.faults)
        self._unit = {entry.name: entry.unit for entry in entries}
        self._kind = {entry.name: entry.kind for entry in entries}
        self._rows, self._most = 0, most
        self._times = array("d")
        self._signals = np.empty((_FIRST_ROWS if most is None else 2 * most, len(image.signals)))
        self._other_index = {name: column for column, name in enumerate((*image.command_names, *image.fault_names))}
        self._now: F8 = np.array([math.nan] * len(image.commands) + [0.0] * len(image.faults))
        self._others = np.empty((len(self._signals), len(self._now)))
        self._given: dict[str, float] = {}
        self.marks: list[Mark] = []
        """Faults injected and commands given by the test, in order."""

    def __len__(self) -> int:
        """Ticks in it."""
        return self._rows - self._first

    @property
    def _first(self) -> int:
        """The first row that is kept."""
        return 0 if self._most is None else max(self._rows - self._most, 0)

    @property
    def names(self) -> tuple[str, ...]:
        """All that there is: signals, commands, faults, then the alarms that were raised."""
        return (*self._index, *self._other_index)

    @property
    def time(self) -> F8:
        """Simulated time of each tick, (n,), s."""
        return np.array(self._times[self._first :])

    def __getitem__(self, name: str) -> F8:
        """A column (n,), in the unit of the process image. Raises ConveyorError for a name that there is not."""
        if name in self._index:
            return self._signals[self._first : self._rows, self._index[name]].copy()
        if name in self._other_index:
            return self._others[self._first : self._rows, self._other_index[name]].copy()
        raise ConveyorError(f"{name}: not in the history, expected one of {', '.join(self.names)}")

    def unit(self, name: str) -> str:
        """The unit of a column, "" where it has none."""
        unit = self._unit.get(name, "1")
        return "" if unit == "1" else unit

    def kind(self, name: str) -> Kind:
        """The type of a column; of an alarm it is bool, of a controller's variable number."""
        return "bool" if name.startswith(ALARMS) else self._kind.get(name, "number")

    def begin_tick(self, time: float, signals: F8) -> None:
        """A tick is reached; commands, faults and alarms go on as they are."""
        if self._rows == len(self._signals) and self._most is not None:
            for rows in (self._signals, self._others):
                rows[: self._most] = rows[self._first :]
            self._times, self._rows = self._times[self._first :], self._most
        elif self._rows == len(self._signals):
            self._signals = np.concatenate([self._signals, np.empty_like(self._signals)])
            self._others = np.concatenate([self._others, np.empty_like(self._others)])
        self._signals[self._rows] = signals
        self._others[self._rows] = self._now
        self._rows += 1
        self._times.append(time)

    def take(self, outcome: CommandOutcome, from_test: bool) -> None:
        """What was applied at the last tick. from_test: by the test itself, not by the controller."""
        if what := _MARKED.get(outcome.operation):
            names, values = outcome.names or ("all",), outcome.values or (math.nan,) * max(1, len(outcome.names))
            self.marks += [
                Mark(self._times[-1], f"{name} {what}", value) for name, value in zip(names, values, strict=True)
            ]
        if outcome.operation not in (SET, INJECT):
            return
        for name, value in zip(outcome.names, outcome.values, strict=True):
            if name.startswith(ALARMS):  # noted as the controller gave it
                continue
            if self._given.get(name) != value:
                self._given[name] = value
                self._set(name, value)
            if from_test or outcome.operation == INJECT:
                self.marks.append(Mark(self._times[-1], name, value))

    def alarms(self, alarms: Mapping[str, float]) -> None:
        """The alarms of the last tick, by their whole names."""
        self._note(alarms, 0.0)

    def watch(self, variables: Mapping[str, float]) -> None:
        """Variables of the controller at the last tick, by name; NaN until this is called with them."""
        self._note(variables, math.nan)

    def _note(self, columns: Mapping[str, float], before: float) -> None:
        for name, value in columns.items():
            if name not in self._other_index:
                self._other_index[name] = len(self._now)
                self._now = np.append(self._now, before)
                self._others = np.hstack([self._others, np.full((len(self._others), 1), before)])
            self._set(name, value)

    def _set(self, name: str, value: float) -> None:
        column = self._other_index[name]
        self._now[column] = self._others[self._rows - 1, column] = value

# SPDX-License-Identifier: Apache-2.0
"""`ScenarioHistory`: every signal, command, fault and alarm at every tick of a scenario, as arrays."""

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
from conveyor_sim.line.tag import Kind, ProcessImage

F8 = NDArray[np.float64]

_FIRST_ROWS = 1024

_MARKED = {MODE: "mode", FORCE: "forced", UNFORCE: "unforced"}
"""Words for operations other than commands and faults that are marked."""


@dataclass(frozen=True)
class HistoryMark:
    """An input of the test, an operation of a person, or a fault."""

    time: float
    """s"""
    name: str
    """Tag, with the operation if it is no command or fault."""
    value: float
    """NaN if the operation takes no value."""


class ScenarioHistory:
    """Columns by name, with one entry per tick, from the first tick of the scenario or for the last ticks only.

    A signal has its value at the tick. A command has the value in force from the tick on, NaN until first given. A
    fault has the same, 0 until first injected. An alarm ("alarms/<name>") is 1 while it stands.
    """

    def __init__(self, image: ProcessImage, most: int | None = None) -> None:
        """most: number of last ticks to store, at least one; None: all."""
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
        self.marks: list[HistoryMark] = []
        """Faults injected and commands given by the test, in order."""

    def __len__(self) -> int:
        """Return the number of ticks stored."""
        return self._rows - self._first

    @property
    def _first(self) -> int:
        """First row that is stored."""
        return 0 if self._most is None else max(self._rows - self._most, 0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns: signals, commands, faults, then the alarms that were raised."""
        return (*self._index, *self._other_index)

    @property
    def time(self) -> F8:
        """Simulated time of each tick, (n,), s."""
        return np.array(self._times[self._first :])

    def __getitem__(self, name: str) -> F8:
        """Return a column (n,), in the unit of the process image. Raise ConveyorError for an unknown name."""
        if name in self._index:
            return self._signals[self._first : self._rows, self._index[name]].copy()
        if name in self._other_index:
            return self._others[self._first : self._rows, self._other_index[name]].copy()
        raise ConveyorError(f"{name}: not in the history, expected one of {', '.join(self.names)}")

    def unit(self, name: str) -> str:
        """Return the unit of a column, "" if it has none."""
        unit = self._unit.get(name, "1")
        return "" if unit == "1" else unit

    def kind(self, name: str) -> Kind:
        """Return the type of a column: bool for alarms, number for variables of a controller."""
        return "bool" if name.startswith(ALARMS) else self._kind.get(name, "number")

    def begin_tick(self, time: float, signals: F8) -> None:
        """Add a row for a tick. Commands, faults and alarms keep their values."""
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
        """Add an input that the last tick applied. from_test: it came from the test, not from the controller."""
        if what := _MARKED.get(outcome.operation):
            names, values = outcome.names or ("all",), outcome.values or (math.nan,) * max(1, len(outcome.names))
            self.marks += [
                HistoryMark(self._times[-1], f"{name} {what}", value) for name, value in zip(names, values, strict=True)
            ]
        if outcome.operation not in (SET, INJECT):
            return
        for name, value in zip(outcome.names, outcome.values, strict=True):
            if name.startswith(ALARMS):  # added by `alarms`
                continue
            if self._given.get(name) != value:
                self._given[name] = value
                self._set(name, value)
            if from_test or outcome.operation == INJECT:
                self.marks.append(HistoryMark(self._times[-1], name, value))

    def alarms(self, alarms: Mapping[str, float]) -> None:
        """Add the alarms of the last tick, by their full names."""
        self._note(alarms, 0.0)

    def watch(self, variables: Mapping[str, float]) -> None:
        """Add variables of the controller at the last tick, by name. They are NaN before their first call."""
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

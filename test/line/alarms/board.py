# SPDX-License-Identifier: Apache-2.0
"""Alarms without a line, driven tick by tick, and their events."""

from collections.abc import Mapping
from typing import Any

from conveyor_sim.line.alarms import operations
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.alarms.declaration import Declared
from conveyor_sim.scene.parts.alarm import AlarmFields

SIGNALS = ("zones/table/bottles", "belts/table/speed")


class Board:
    """Ticks of 0.1 s."""

    def __init__(self, **declared: Mapping[str, Any]) -> None:
        self.tick = 0
        self.events: list[tuple[int, str, str]] = []
        """Tick, kind without `alarm_`, id."""
        self.texts: list[str] = []
        self.alarms = Alarms(0.1, self._note, SIGNALS)
        self.declare(**declared)

    def declare(self, own: bool = False, **declared: Mapping[str, Any]) -> str:
        """Declare an alarm, and return why it was refused, "" if it was not."""
        alarms = [Declared(id, AlarmFields(**fields)) for id, fields in declared.items()]
        problem = self.alarms.declaration_problem(alarms)
        if problem is None:
            self.alarms.declare(self.tick, alarms, "line" if own else "plc", own)
        return "" if problem is None else str(problem)

    def say(self, **conditions: bool) -> list[str]:
        """Report conditions, and return the kinds and ids of the resulting events."""
        before = len(self.events)
        self.alarms.report(self.tick, conditions)
        return [f"{kind} {id}" for _, kind, id in self.events[before:]]

    def to(self, tick: int) -> list[str]:
        """Advance to the end of a tick, and return the kinds and ids of the resulting events."""
        before = len(self.events)
        while self.tick < tick:
            self.tick += 1
            self.alarms.end(self.tick)
        return [f"{kind} {id}" for _, kind, id in self.events[before:]]

    def do(self, operation: str, *ids: str, values: tuple[float, ...] = (), by: str = "anna") -> str:
        """Do an operation, and return why it was refused, "" if it was not."""
        problem = operations.problem(self.alarms, operation, ids, values)
        if not problem:
            operations.perform(self.alarms, operation, ids, values, by, self.tick)
        return problem

    def states(self) -> dict[str, str]:
        return {alarm.id: alarm.state.name for alarm in self.alarms}

    def _note(self, tick: int, kind: str, name: str, value: float, text: str) -> None:
        id = name.removeprefix("alarms/")
        assert value == float(self.alarms[id].stands)
        self.events.append((tick, kind.removeprefix("alarm_"), id))
        self.texts.append(text)

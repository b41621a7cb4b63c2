"""`AlarmSystem`: the alarms of one line, tied to its devices, its scene and its inputs."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.errors import SceneError
from conveyor_sim.line.alarm_conditions import LimitConditions, MeasuredConditions, Signals, limit_alarms, scene_alarms
from conveyor_sim.line.alarms import memory, operations
from conveyor_sim.line.alarms.alarms import Alarms, Note
from conveyor_sim.line.alarms.declaration import MOST_ALARMS, parse
from conveyor_sim.line.commands.inputs import DECLARE, Input
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import count, switch
from conveyor_sim.scene.parts.alarm import PREFIX
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.schema import Scene


class AlarmSystem:
    """Asks at ticks for the conditions that the line finds out by itself, and takes what others say."""

    def __init__(self, scene: Scene, devices: Sequence[Device], modes: Signals, note: Note) -> None:
        """devices: all others; modes: of these. Raises SceneError for alarms of a scene that can't be."""
        sources = (*devices, modes)
        signals = [tag.name for source in sources for tag in source.signals]
        self.alarms = Alarms(scene.tick, note, signals)
        line = [declared for device in devices for declared in device.alarms] + limit_alarms(scene)
        self.alarms.declare(0, line, "line", own=True)
        given = scene_alarms(scene)
        if (problem := self.alarms.declaration_problem(given)) is not None:
            place = Places(scene).of(("alarms", problem.id, problem.field))
            raise SceneError(f"{place}: alarms.{problem.id}.{problem.field}: {problem.text}")
        self.alarms.declare(0, given, "scene", own=True)
        self.device = AlarmsDevice(self.alarms)
        """What controllers read of them."""
        self._measured = MeasuredConditions(self.alarms, sources)
        self._limits = LimitConditions(self.alarms)

    def operations(self) -> dict[str, Operation]:
        """What can be done to alarms, by name."""
        rows = {name: Operation(self._refusal, self._perform) for name in operations.OPERATIONS}
        return {**rows, DECLARE: Operation(self._declaration_refusal, self._declare)}

    def begin(self) -> None:
        """A tick begins."""
        self.alarms.changed = False

    def said_problem(self, names: Sequence[str], values: Sequence[float]) -> str:
        """Why alarms among the names can't be said, "" if they can; each by itself is known to be one."""
        said = _said(names, values)
        for id in said:
            if problem := self.alarms.value_problem(id):
                return problem
        return self.alarms.room_problem(said) if said else ""

    def say(self, tick: int, names: Sequence[str], values: Sequence[float]) -> None:
        """What a controller says; it counts whatever became of the commands beside it. What can't be is left out."""
        said = {id: on for id, on in _said(names, values).items() if not self.alarms.value_problem(id)}
        if said:
            self.alarms.say(tick, said)

    def take(self, now: ScanContext) -> None:
        """What devices have said."""
        if now.conditions:
            said, now.conditions = now.conditions, {}
            self.alarms.say(now.tick, said)

    def close(
        self,
        now: ScanContext,
        passed: Sequence[DamageEvent],
        clogged: Mapping[str, bool],
        forced: Mapping[str, float],
    ) -> None:
        """A tick has ended, in which limits were passed. clogged: outfeeds; forced: signals, as they are read."""
        if measured := self._measured.changes(now, forced):
            now.conditions |= measured
        if limits := self._limits.changes(passed, clogged):
            now.conditions |= limits
        self.take(now)
        self.alarms.end(now.tick)

    def snapshot(self) -> dict[str, Any]:
        """All that is remembered from tick to tick, as plain data."""
        return memory.snapshot(self.alarms)

    def restore(self, tick: int, kept: Any) -> None:
        """Stand as those of the same line did at a tick. Raises ValueError for what can't be."""
        memory.restore(self.alarms, tick, kept)

    def _refusal(self, given: Input) -> str:
        if given.texts:
            return f"{len(given.texts)} texts given, expected none"
        return operations.problem(self.alarms, given.operation, given.names, given.values)

    def _perform(self, given: Input, now: ScanContext) -> None:
        by = _writer(given)
        operations.perform(self.alarms, given.operation, given.names, given.values, by, now.tick)

    def _declaration_refusal(self, given: Input) -> str:
        if given.values:
            return f"{len(given.values)} values given, expected none"
        declared = parse(given.names, given.texts)
        if isinstance(declared, str):
            return declared
        problem = self.alarms.declaration_problem(declared)
        return "" if problem is None else str(problem)

    def _declare(self, given: Input, now: ScanContext) -> None:
        declared = parse(given.names, given.texts)
        assert not isinstance(declared, str)  # it was not refused
        self.alarms.declare(now.tick, declared, _writer(given))


def _writer(given: Input) -> str:
    return given.writer or given.writer_kind


def _said(names: Sequence[str], values: Sequence[float]) -> dict[str, bool]:
    """Alarms among names and values, by id; of what is no alarm nothing."""
    if len(names) != len(values):
        return {}
    found = _alarms_among(tuple(names))
    return {id: values[place] == 1.0 for place, id in found if values[place] in (0.0, 1.0)} if found else {}


@lru_cache(maxsize=64)
def _alarms_among(names: tuple[str, ...]) -> tuple[tuple[int, str], ...]:
    """Places and ids of alarms; a controller gives the same names in every scan."""
    given = [(place, name.removeprefix(PREFIX)) for place, name in enumerate(names) if name.startswith(PREFIX)]
    return tuple((place, id) for place, id in given if id)


NAME = "alarms"
COUNTS = "alarm_counts"
"""What the names of its counts begin with: those of alarms may be anything."""


class AlarmsDevice(Device):
    """Which alarms of line and scene stand, and how many in all. What it remembers, the alarms themselves do."""

    def __init__(self, alarms: Alarms) -> None:
        """alarms: with those of line and scene, and no others yet."""
        most = len(alarms) + MOST_ALARMS
        standing = "alarms that stand, of controllers too."
        super().__init__(
            NAME,
            [
                count(f"{COUNTS}/errors", "alarm", f"Errors among the {standing}", high=most),
                count(f"{COUNTS}/warnings", "alarm", f"Warnings among the {standing}", high=most),
                count(f"{COUNTS}/messages", "alarm", f"Messages among the {standing}", high=most),
                count(f"{COUNTS}/unacknowledged", "alarm", "Alarms that wait to be acknowledged.", high=most),
                count(f"{COUNTS}/first_out", "alarm", "Number of the alarm that came first, 0 without one."),
                *(switch(PREFIX + alarm.id, "alarm", "It is active or latched, and not hidden.") for alarm in alarms),
            ],
        )
        self.classify(NAME)
        self._alarms = alarms

    def values(self, now: ScanContext) -> Sequence[float]:
        """The counts, then 1 for each that stands."""
        return self._alarms.tag_values()

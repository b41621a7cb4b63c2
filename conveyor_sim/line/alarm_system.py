# SPDX-License-Identifier: Apache-2.0
"""`AlarmSystem`: the alarms of one line, connected to its devices, scene and inputs."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.errors import SceneError
from conveyor_sim.line.alarms import memory, operations
from conveyor_sim.line.alarms.alarm import LineAlarm
from conveyor_sim.line.alarms.alarms import Alarms, Note
from conveyor_sim.line.alarms.declaration import LINE_GROUP, MOST_ALARMS, Declared, error, parse
from conveyor_sim.line.commands.inputs import DECLARE, Input
from conveyor_sim.line.commands.operation import Operation
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.tag import Tag, count, switch
from conveyor_sim.scene.parts.alarm import PREFIX, AlarmFields
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.schema import Scene


class Signals(Protocol):
    """Provider of signals: a device, or the control modes of all devices."""

    @property
    def signals(self) -> Sequence[Tag]:
        """Tags of the signals."""

    @property
    def read(self) -> Callable[[ScanContext], Sequence[float]]:
        """Function that reads all values, in the order of `signals`."""


class _Watched(NamedTuple):
    alarm: LineAlarm
    column: int
    """Index of its signal in the values of the provider."""


class MeasuredConditions:
    """Conditions on measured signals. Each provider of such signals is read once per tick, others never."""

    def __init__(self, alarms: Alarms, sources: Sequence[Signals]) -> None:
        self._alarms, self._sources = alarms, sources
        self._of: tuple[LineAlarm, ...] = ()
        self._watched: list[tuple[Signals, list[_Watched]]] = []

    def changes(self, now: ScanContext, forced: Mapping[str, float]) -> dict[str, bool]:
        """Return the conditions that have begun or ended, by id.

        forced: values of forced signals.
        """
        if self._of is not self._alarms.measured:
            self._find()
        changed: dict[str, bool] = {}
        for source, watched in self._watched:
            values = source.read(now)
            for alarm, column in watched:
                value = forced.get(alarm.fields.tag or "") if forced else None
                holds = beyond(alarm, float(values[column]) if value is None else value)
                if holds is not alarm.condition:
                    changed[alarm.id] = holds
        return changed

    def _find(self) -> None:
        self._of = self._alarms.measured
        wanted = {alarm.fields.tag for alarm in self._of}
        self._watched = []
        for source in self._sources:
            columns = {tag.name: column for column, tag in enumerate(source.signals) if tag.name in wanted}
            if columns:
                here = [_Watched(alarm, columns[tag]) for alarm in self._of if (tag := alarm.fields.tag) in columns]
                self._watched.append((source, here))


def beyond(alarm: LineAlarm, value: float) -> bool:
    """Return True if an alarm's condition holds at a value. NaN keeps the present condition."""
    fields = alarm.fields
    band = fields.deadband if alarm.condition else 0.0
    if fields.high is not None and value > fields.high - band:
        return True
    if fields.low is not None and value < fields.low + band:
        return True
    return alarm.condition if value != value else False


LIMITS = "limits/"
"""Prefix of the ids of limit alarms."""

CLOGGING = "clogging_time"
"""Limit with one alarm per outfeed."""

PASSED_FOR = 1.0
"""Time for which a limit alarm stays active after the limit was passed, s. Bottles pass it one by one."""


def scene_alarms(scene: Scene) -> list[Declared]:
    """Return the alarms that the scene declares."""
    return [Declared(name, AlarmFields(**vars(alarm))) for name, alarm in scene.alarms.items()]


def limit_alarms(scene: Scene) -> list[Declared]:
    """Return one alarm per limit of the scene, and one per outfeed that can clog."""
    declared = []
    for kind, value in scene.limits:
        if value is not None and kind == CLOGGING:
            for name in scene.outfeeds:
                outfeed = f"outfeeds/{name}"
                declared.append(error(f"{outfeed}/clogged", f"nothing leaves by {outfeed}", f"{outfeed}/removed"))
        elif value is not None:
            text = f"a bottle has passed limits.{kind}"
            fields = AlarmFields(text=text, latching=True, off_delay=PASSED_FOR, group=LINE_GROUP)
            declared.append(Declared(LIMITS + kind, fields))
    return declared


class LimitConditions:
    """Conditions of limit alarms (passed in a tick) and of clogged outfeeds."""

    def __init__(self, alarms: Alarms) -> None:
        """Find the limit alarms.

        alarms: all alarms, limit alarms included.
        """
        self._alarms = [alarm for alarm in alarms if alarm.own and alarm.id.startswith(LIMITS)]
        self._all = alarms

    def changes(self, passed: Sequence[DamageEvent], clogged: Mapping[str, bool]) -> dict[str, bool]:
        """Return the conditions that have begun or ended, by id.

        passed: limits passed in the tick that ends. clogged: True if clogged, by name of the outfeed.
        """
        if not (self._alarms or clogged):
            return {}
        now = {f"outfeeds/{name}/clogged": on for name, on in clogged.items()}
        if self._alarms:
            kinds = {LIMITS + limit.kind for limit in passed}
            now.update({alarm.id: alarm.id in kinds for alarm in self._alarms})
        return {id: on for id, on in now.items() if on is not self._all[id].condition}


class AlarmSystem:
    """Alarms of one line. Evaluates conditions at ticks, and takes those that devices and controllers report."""

    def __init__(self, scene: Scene, devices: Sequence[Device], modes: Signals, note: Note) -> None:
        """Declare the alarms of the line and the scene.

        devices: all devices of the line except that of the alarms. modes: control modes of these devices.
        Raise SceneError for invalid alarms of the scene.
        """
        sources = (*devices, modes)
        signals = [tag.name for source in sources for tag in source.signals]
        self.alarms = Alarms(scene.tick, note, signals)
        line = [declared for device in devices for declared in device.alarms] + limit_alarms(scene)
        self.alarms.declare(0, line, "line", own=True)
        declared = scene_alarms(scene)
        if (problem := self.alarms.declaration_problem(declared)) is not None:
            place = Places(scene).of(("alarms", problem.id, problem.field))
            raise SceneError(f"{place}: alarms.{problem.id}.{problem.field}: {problem.text}")
        self.alarms.declare(0, declared, "scene", own=True)
        self.device = AlarmsDevice(self.alarms)
        """Signals of the alarms."""
        self._measured = MeasuredConditions(self.alarms, sources)
        self._limits = LimitConditions(self.alarms)

    def operations(self) -> dict[str, Operation]:
        """Return the operations on alarms, by name."""
        rows = {name: Operation(self._refusal, self._perform) for name in operations.OPERATIONS}
        return {**rows, DECLARE: Operation(self._declaration_refusal, self._declare)}

    def begin(self) -> None:
        """Start a tick without changes."""
        self.alarms.changed = False

    def report_problem(self, names: Sequence[str], values: Sequence[float]) -> str:
        """Return why alarms among the names can't be set, "" if they can. Each name is already checked."""
        reported = _reported(names, values)
        for id in reported:
            if problem := self.alarms.value_problem(id):
                return problem
        return self.alarms.room_problem(reported) if reported else ""

    def report(self, tick: int, names: Sequence[str], values: Sequence[float]) -> None:
        """Set the alarms that a controller reports, even if its commands were refused. Leave out invalid alarms."""
        reported = {id: on for id, on in _reported(names, values).items() if not self.alarms.value_problem(id)}
        if reported:
            self.alarms.report(tick, reported)

    def take(self, now: ScanContext) -> None:
        """Set the alarms that devices have reported."""
        if now.conditions:
            reported, now.conditions = now.conditions, {}
            self.alarms.report(now.tick, reported)

    def close(
        self,
        now: ScanContext,
        passed: Sequence[DamageEvent],
        clogged: Mapping[str, bool],
        forced: Mapping[str, float],
    ) -> None:
        """End a tick.

        passed: limits passed in it. clogged: True if clogged, by name of the outfeed. forced: values of forced signals.
        """
        if measured := self._measured.changes(now, forced):
            now.conditions |= measured
        if limits := self._limits.changes(passed, clogged):
            now.conditions |= limits
        self.take(now)
        self.alarms.end(now.tick)

    def snapshot(self) -> dict[str, Any]:
        """Return all state that lasts from tick to tick, as plain data."""
        return memory.snapshot(self.alarms)

    def restore(self, tick: int, memory_data: Any) -> None:
        """Restore the alarms of the same line at a tick. Raise ValueError for data that do not fit."""
        memory.restore(self.alarms, tick, memory_data)

    def _refusal(self, request: Input) -> str:
        if request.texts:
            return f"{len(request.texts)} texts given, expected none"
        return operations.problem(self.alarms, request.operation, request.names, request.values)

    def _perform(self, request: Input, now: ScanContext) -> None:
        by = _writer(request)
        operations.perform(self.alarms, request.operation, request.names, request.values, by, now.tick)

    def _declaration_refusal(self, request: Input) -> str:
        if request.values:
            return f"{len(request.values)} values given, expected none"
        declared = parse(request.names, request.texts)
        if isinstance(declared, str):
            return declared
        problem = self.alarms.declaration_problem(declared)
        return "" if problem is None else str(problem)

    def _declare(self, request: Input, now: ScanContext) -> None:
        declared = parse(request.names, request.texts)
        assert not isinstance(declared, str)  # it was not refused
        self.alarms.declare(now.tick, declared, _writer(request))


def _writer(request: Input) -> str:
    return request.writer or request.writer_kind


def _reported(names: Sequence[str], values: Sequence[float]) -> dict[str, bool]:
    """Return the alarms among names and values, by id; {} if there are none."""
    if len(names) != len(values):
        return {}
    alarms = _alarms_among(tuple(names))
    return {id: values[place] == 1.0 for place, id in alarms if values[place] in (0.0, 1.0)}


@lru_cache(maxsize=64)
def _alarms_among(names: tuple[str, ...]) -> tuple[tuple[int, str], ...]:
    """Return places and ids of alarms. Cached, because a controller repeats its names in every scan."""
    alarms = [(place, name.removeprefix(PREFIX)) for place, name in enumerate(names) if name.startswith(PREFIX)]
    return tuple((place, id) for place, id in alarms if id)


NAME = "alarms"
COUNTS = "alarm_counts"
"""Prefix of the names of the counts, because alarms may have any name."""


class AlarmsDevice(Device):
    """Signals of standing alarms and their counts. The state is stored by the alarms themselves."""

    def __init__(self, alarms: Alarms) -> None:
        """Build the signals.

        alarms: alarms of line and scene, before controllers declare any.
        """
        most = len(alarms) + MOST_ALARMS
        standing = "standing alarms, including those of controllers."
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
        """Return the counts, then 1 for each alarm that stands."""
        return self._alarms.tag_values()

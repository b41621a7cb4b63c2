"""Alarm conditions that the line evaluates: measured signals, passed limits, clogged outfeeds."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.line.alarms.alarm import LineAlarm
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.alarms.declaration import LINE_GROUP, Declared, error
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.tag import Tag
from conveyor_sim.scene.parts.alarm import AlarmFields
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

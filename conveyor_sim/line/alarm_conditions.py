"""Conditions of alarms on measured values: those of the scene, and of controllers that gave a limit."""

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
    """What has signals: a device, or the modes of all of them."""

    @property
    def signals(self) -> Sequence[Tag]: ...

    @property
    def read(self) -> Callable[[ScanContext], Sequence[float]]:
        """What gives their values, in their order."""


class _Watched(NamedTuple):
    alarm: LineAlarm
    column: int
    """Of its signal among those beside it."""


class MeasuredConditions:
    """Looks at the devices whose signals have alarms, each once a tick, and at no others."""

    def __init__(self, alarms: Alarms, sources: Sequence[Signals]) -> None:
        self._alarms, self._sources = alarms, sources
        self._of: tuple[LineAlarm, ...] = ()
        self._watched: list[tuple[Signals, list[_Watched]]] = []

    def changes(self, now: ScanContext, forced: Mapping[str, float]) -> dict[str, bool]:
        """The conditions that have begun or ended, by id. forced: signals that are read otherwise than they are."""
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
    """Whether its condition holds at a value; where that is no number, it stays as it is."""
    fields = alarm.fields
    band = fields.deadband if alarm.condition else 0.0
    if fields.high is not None and value > fields.high - band:
        return True
    if fields.low is not None and value < fields.low + band:
        return True
    return alarm.condition if value != value else False


LIMITS = "limits/"
"""What the ids of the limits' alarms begin with."""

CLOGGING = "clogging_time"
"""The limit whose alarm each outfeed has for itself."""

PASSED_FOR = 1.0
"""s for which the alarm of a limit stays active once it was passed: bottles pass it one by one."""


def scene_alarms(scene: Scene) -> list[Declared]:
    """Those that the scene declares."""
    return [Declared(name, AlarmFields(**vars(alarm))) for name, alarm in scene.alarms.items()]


def limit_alarms(scene: Scene) -> list[Declared]:
    """One for each limit of the scene, and for each outfeed that can clog."""
    found = []
    for kind, value in scene.limits:
        if value is not None and kind == CLOGGING:
            for name in scene.outfeeds:
                outfeed = f"outfeeds/{name}"
                found.append(error(f"{outfeed}/clogged", f"nothing leaves by {outfeed}", f"{outfeed}/removed"))
        elif value is not None:
            text = f"a bottle has passed limits.{kind}"
            fields = AlarmFields(text=text, latching=True, off_delay=PASSED_FOR, group=LINE_GROUP)
            found.append(Declared(LIMITS + kind, fields))
    return found


class LimitConditions:
    """Conditions of the alarms of limits: that one was passed in a tick; that an outfeed is clogged."""

    def __init__(self, alarms: Alarms) -> None:
        """alarms: with those of the limits."""
        self._alarms = [alarm for alarm in alarms if alarm.own and alarm.id.startswith(LIMITS)]
        self._all = alarms

    def changes(self, passed: Sequence[DamageEvent], clogged: Mapping[str, bool]) -> dict[str, bool]:
        """Those that have begun or ended, by id. passed: in the tick that ends; clogged: outfeeds."""
        if not (self._alarms or clogged):
            return {}
        now = {f"outfeeds/{name}/clogged": on for name, on in clogged.items()}
        if self._alarms:
            kinds = {LIMITS + limit.kind for limit in passed}
            now.update({alarm.id: alarm.id in kinds for alarm in self._alarms})
        return {id: on for id, on in now.items() if on is not self._all[id].condition}

"""Conditions of alarms on measured values: those of the scene, and of controllers that gave a limit."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from conveyor_sim.line.alarms.alarm import Alarm
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.tag import Tag


class Signals(Protocol):
    """What has signals: a device, or the modes of all of them."""

    @property
    def signals(self) -> Sequence[Tag]: ...

    @property
    def read(self) -> Callable[[ScanContext], Sequence[float]]:
        """What gives their values, in their order."""


class _Watched(NamedTuple):
    alarm: Alarm
    column: int
    """Of its signal among those beside it."""


class Measured:
    """Looks at the devices whose signals have alarms, each once a tick, and at no others."""

    def __init__(self, alarms: Alarms, sources: Sequence[Signals]) -> None:
        self._alarms, self._sources = alarms, sources
        self._of: tuple[Alarm, ...] = ()
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


def beyond(alarm: Alarm, value: float) -> bool:
    """Whether its condition holds at a value; where that is no number, it stays as it is."""
    fields = alarm.fields
    band = fields.deadband if alarm.condition else 0.0
    if fields.high is not None and value > fields.high - band:
        return True
    if fields.low is not None and value < fields.low + band:
        return True
    return alarm.condition if value != value else False

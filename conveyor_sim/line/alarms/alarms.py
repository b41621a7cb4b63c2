# SPDX-License-Identifier: Apache-2.0
"""`Alarms`: all alarms of a line, with their conditions, suppression and first-out."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from graphlib import CycleError
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.columns.events import Kind
from conveyor_sim.line.alarms.alarm import ACKNOWLEDGED, NEVER, AlarmState, LineAlarm
from conveyor_sim.line.alarms.declaration import MOST_ALARMS, Declared, ranks
from conveyor_sim.scene.parts.alarm import CLASSES, PREFIX, AlarmFields
from conveyor_sim.support.printable import printable

Note = Callable[[int, Kind, str, float, str], None]
"""Records an event: tick, kind, name, value (1 while the alarm stands), text."""


class DeclarationProblem(NamedTuple):
    """Reason why an alarm can't be declared."""

    id: str
    field: str
    text: str
    """Value that was received, and the expected one."""

    def __str__(self) -> str:
        return ": ".join(part for part in (f"alarm {self.id}", self.field, self.text) if part)


class Alarms:
    """All alarms of a line.

    Conditions are reported as they change; delays are stored as deadlines. An alarm without changes costs no time.
    """

    def __init__(self, tick: float, note: Note, signals: Collection[str]) -> None:
        """Start without alarms.

        tick: its length, s. signals: names of signals that alarms can measure.
        """
        self.tick, self._note, self._signals = tick, note, signals
        self._all: dict[str, LineAlarm] = {}
        self._groups: dict[str, list[LineAlarm]] = {}
        self._follow: dict[str, list[LineAlarm]] = {}  # alarms that an id suppresses
        self._next: float = np.inf  # tick of the earliest deadline
        self._tags: tuple[float, ...] | None = None
        self.numbered = 0
        """Count of all alarms so far, including those removed since."""
        self.first: dict[str, str] = {}
        """Id of the first-out alarm, by group in which an alarm is not normal; in the order of their start."""
        self.measured: tuple[LineAlarm, ...] = ()
        """Alarms whose conditions the line measures."""
        self.changed = True
        """True if any displayed value has changed since the last tick."""

    def __getitem__(self, id: str) -> LineAlarm:
        """Return the alarm of an id. Raise KeyError if there is none."""
        return self._all[id]

    def __contains__(self, id: object) -> bool:
        return id in self._all

    def __iter__(self) -> Iterator[LineAlarm]:
        """Iterate in the order of the numbers."""
        return iter(self._all.values())

    def __len__(self) -> int:
        return len(self._all)

    def declaration_problem(self, declared: Sequence[Declared]) -> DeclarationProblem | None:
        """Return why alarms can't be declared, None if they can."""
        new = dict(declared)
        for id, fields in declared:
            present = self._all.get(id)
            if present is not None and present.own:
                return DeclarationProblem(id, "id", f"is declared by the {present.declared_by}, expected another id")
            if fields.tag is not None and fields.tag not in self._signals:
                expected = f"expected a signal of a device{_hint(fields.tag, self._signals)}"
                return DeclarationProblem(id, "tag", f"{printable(fields.tag)} given, {expected}")
            for cause in fields.suppressed_by:
                if cause not in new and cause not in self._all:
                    expected = "expected an alarm that is declared before or together with it"
                    hint = _hint(cause, [*new, *self._all])
                    return DeclarationProblem(id, "suppressed_by", f"{cause} given, {expected}{hint}")
        try:
            ranks({**{alarm.id: alarm.fields.suppressed_by for alarm in self}, **_causes(new)})
        except CycleError as error:
            text = printable(" by ".join(error.args[1][::-1]))
            expected = "expected no alarm that suppresses itself in a circle"
            first = next(id for id in new if id in error.args[1])
            return DeclarationProblem(first, "suppressed_by", f"{text} given, {expected}")
        required = self._required() | {id for causes in _causes(new).values() for id in causes if not self._own(id)}
        if len(required | new.keys()) > MOST_ALARMS:
            text = f"{len(new)} alarms declared beside {len(required - new.keys())}, expected {MOST_ALARMS} at most"
            return DeclarationProblem(declared[0].id, "", text)
        return None

    def declare(self, tick: int, declared: Sequence[Declared], by: str, own: bool = False) -> None:
        """Declare alarms that `declaration_problem` accepts.

        by: writer of the declaration, never "". own: True for alarms of the line or the scene, which controllers can
        neither set nor declare.
        """
        changed, named = [], {id for one in declared for id in (one.id, *one.fields.suppressed_by)}
        if not own:
            self._make_room(sum(id not in self._all for id, _ in declared), named)
        for id, fields in declared:
            alarm = self._all.get(id)
            if alarm is None:
                changed.append(self._add(id, fields, by, own))
            elif (alarm.fields, alarm.declared_by) != (fields, by):
                alarm.declare(fields, by, self.tick)
                changed.append(alarm)
        if changed:
            self._arrange()
            self.settle(tick, changed)

    def restored(self, alarms: Iterable[LineAlarm], numbered: int, first: dict[str, str]) -> None:
        """Replace all alarms by these."""
        self._all = {alarm.id: alarm for alarm in alarms}
        self.numbered, self.first = numbered, first
        self._arrange()
        for alarm in sorted(self, key=lambda alarm: alarm.rank):
            alarm.suppressed = self._caused(alarm)
            alarm.recall()
        self._next, self._tags, self.changed = 0, None, True

    def value_problem(self, id: str) -> str:
        """Return why a controller can't set or clear an alarm, "" if it can."""
        alarm = self._all.get(id)
        if alarm is not None and alarm.own:
            return f"{PREFIX}{id}: is an alarm of the {alarm.declared_by}, expected one of a controller"
        if alarm is not None and alarm.fields.measured:
            return f"{PREFIX}{id}: is measured by the line, expected an alarm without `high` and `low`"
        return ""

    def room_problem(self, reported: Mapping[str, bool]) -> str:
        """Return why the line can't hold all the reported alarms, "" if it can."""
        if all(id in self._all for id in reported):
            return ""
        required = self._required()
        after = (required | {id for id, on in reported.items() if on}) - {
            id for id in required if not reported.get(id, True) and self._spare(self._all[id], reported=False)
        }
        if len(after) <= MOST_ALARMS:
            return ""
        raised = sum(reported.values())
        return (
            f"{raised} alarms given beside {len(required)} that stand or are declared, expected {MOST_ALARMS} at most"
        )

    def report(self, tick: int, reported: Mapping[str, bool]) -> None:
        """Set the conditions of several alarms at a tick, all of them at once.

        An undeclared alarm gets default fields. If there is no room for all new ones, those whose condition holds come
        first.
        """
        new = [id for id in reported if id not in self._all]
        turned = [self._all[id] for id, on in reported.items() if id in self._all and self._report(id, on, tick)]
        if turned:
            self.settle(tick, turned)
        # Only now, because alarms that have just ended may be removed.
        if room := self._make_room(len(new)) if new else 0:
            first = new if room == len(new) else sorted(new, key=lambda id: not reported[id])[:room]
            made = [self._add(id, UNDECLARED, "", False) for id in first]
            for id in first:
                self._report(id, reported[id], tick)
            self.settle(tick, made)

    def end(self, tick: int) -> None:
        """Apply the deadlines of a tick that ends."""
        if tick < self._next:
            return
        due, self._next = [], np.inf
        for alarm in self:
            if NEVER < alarm.due <= tick:
                alarm.active, alarm.due = alarm.condition, NEVER
                due.append(alarm)
            if NEVER < alarm.shelved_until <= tick:
                alarm.shelved, alarm.shelved_until = "", NEVER
                self.note(tick, "alarm_unshelved", alarm, "its time is over")
                due.append(alarm)
            self.watch(alarm)
        if due:
            self.settle(tick, due)

    def watch(self, alarm: LineAlarm) -> None:
        """Schedule the deadlines of an alarm."""
        for deadline in (alarm.due, alarm.shelved_until):
            if NEVER < deadline < self._next:
                self._next = deadline

    def settle(self, tick: int, touched: Iterable[LineAlarm]) -> None:
        """Update the states of changed alarms and of those they suppress: causes first, then by priority."""
        waiting: list[tuple[int, int, int, str]] = []
        queued: set[str] = set()

        def queue(alarm: LineAlarm) -> None:
            if alarm.id not in queued:
                queued.add(alarm.id)
                heappush(waiting, (alarm.rank, -alarm.fields.severity, alarm.number, alarm.id))

        for alarm in touched:
            queue(alarm)
        while waiting:
            alarm = self._all[heappop(waiting)[-1]]
            caused = self._caused(alarm)
            if alarm.suppressed and not caused and alarm.active and alarm.delays[True]:
                # After its cause, a suppressed alarm has its on-delay to end in.
                alarm.delay(tick + alarm.delays[True])
                self.watch(alarm)
            alarm.suppressed = caused
            for kind in alarm.settle():
                self.note(tick, kind, alarm, self._why(kind, alarm))
            if alarm.fields.group and alarm.main is AlarmState.UNACKNOWLEDGED:
                self.first.setdefault(alarm.fields.group, alarm.id)
            if alarm.state is not alarm.shown:
                alarm.shown, alarm.since = alarm.state, tick
            if alarm.suppresses is not alarm.suppressing:
                alarm.suppressing = alarm.suppresses
                for follower in self._follow.get(alarm.id, ()):
                    queue(follower)
        for group in {self._all[id].fields.group for id in queued} & self.first.keys():
            if all(alarm.main is AlarmState.NORMAL for alarm in self._groups[group]):
                del self.first[group]
        self._tags = None
        self.changed = True

    def note(self, tick: int, kind: Kind, alarm: LineAlarm, text: str) -> None:
        """Record an event of an alarm."""
        self._note(tick, kind, PREFIX + alarm.id, float(alarm.stands), text)

    def counts(self) -> tuple[float, ...]:
        """Return the numbers of standing alarms by class, of unacknowledged ones, and of the first-out alarm.

        The last is the alarm's number, 0 without one.
        """
        standing = [alarm.fields.alarm_class for alarm in self if alarm.stands]
        waiting = sum(alarm.main in ACKNOWLEDGED for alarm in self)
        first = next((self._all[id].number for id in self.first.values()), 0)
        return (*(float(standing.count(kind)) for kind in CLASSES), float(waiting), float(first))

    def tag_values(self) -> tuple[float, ...]:
        """Return `counts`, then 1 for each standing alarm of line and scene, 0 for the others, in their order."""
        if self._tags is None:
            self._tags = (*self.counts(), *(float(alarm.stands) for alarm in self if alarm.own))
        return self._tags

    def controller_alarms(self) -> dict[str, float]:
        """Return 1 or 0 for each alarm of a controller, by its name in the process image."""
        return {PREFIX + alarm.id: float(alarm.stands) for alarm in self if not alarm.own}

    def changes(self) -> AlarmColumns | None:
        """Return all alarms if any changed in this tick, or at the start; None otherwise."""
        return self.columns() if self.changed and self._all else None

    def columns(self) -> AlarmColumns:
        """Return all alarms."""
        alarms = list(self)
        first = set(self.first.values())
        return AlarmColumns(
            number=np.array([alarm.number for alarm in alarms], dtype=np.uint64),
            id=[alarm.id for alarm in alarms],
            text=[alarm.text for alarm in alarms],
            alarm_class=[alarm.fields.alarm_class for alarm in alarms],
            priority=np.array([alarm.fields.severity for alarm in alarms], dtype=np.uint16),
            tag=[alarm.fields.tag or "" for alarm in alarms],
            group=[alarm.fields.group for alarm in alarms],
            suppressed_by=[alarm.fields.suppressed_by for alarm in alarms],
            latching=np.array([alarm.fields.latching for alarm in alarms], dtype=np.bool_),
            declared_by=[alarm.declared_by for alarm in alarms],
            state=np.array([alarm.state for alarm in alarms], dtype=np.uint8),
            active=np.array([alarm.active for alarm in alarms], dtype=np.bool_),
            first_out=np.array([alarm.id in first for alarm in alarms], dtype=np.bool_),
            shelved_until=np.array([alarm.shelved_until for alarm in alarms], dtype=np.int64),
            since=np.array([alarm.since for alarm in alarms], dtype=np.uint64),
            changed_by=[alarm.changed_by for alarm in alarms],
        )

    def _add(self, id: str, fields: AlarmFields, by: str, own: bool) -> LineAlarm:
        self.numbered += 1
        self._all[id] = LineAlarm(id, self.numbered, fields, by, own, self.tick)
        return self._all[id]

    def _arrange(self) -> None:
        """Derive groups, ranks and followers from the declarations."""
        rank_of = ranks({alarm.id: alarm.fields.suppressed_by for alarm in self})
        self._groups, self._follow = {}, {}
        for alarm in self:
            alarm.rank = rank_of[alarm.id]
            if alarm.fields.group:
                self._groups.setdefault(alarm.fields.group, []).append(alarm)
            for cause in alarm.fields.suppressed_by:
                self._follow.setdefault(cause, []).append(alarm)
        self.first = {group: id for group, id in self.first.items() if self._all[id].fields.group == group}
        self.measured = tuple(alarm for alarm in self if alarm.fields.measured)

    def _report(self, id: str, on: bool, tick: int) -> bool:
        """Set one condition. Return True if it changed and has no delay."""
        alarm = self._all[id]
        if alarm.condition is on:
            return False
        alarm.condition = on
        delay = alarm.delays[alarm.condition]
        if alarm.condition is alarm.active:
            alarm.due = NEVER
        elif delay:
            alarm.due = tick + delay
            self.watch(alarm)
        else:
            alarm.active, alarm.due = alarm.condition, NEVER
            return True
        return False

    def _caused(self, alarm: LineAlarm) -> bool:
        return any(self._all[cause].suppressing for cause in alarm.fields.suppressed_by)

    def _why(self, kind: str, alarm: LineAlarm) -> str:
        if kind == "alarm_raised":
            return alarm.fields.text
        if kind == "alarm_suppressed":
            causes = [cause for cause in alarm.fields.suppressed_by if self._all[cause].suppressing]
            return printable(f"follows from {', '.join(causes)}")
        return "its condition has ended" if kind == "alarm_unshelved" else ""

    def _spare(self, alarm: LineAlarm, reported: bool | None = None) -> bool:
        """Return True if an alarm can be removed: undeclared, not standing, neither shelved nor out of service.

        reported: its condition, if not the present one.
        """
        condition = alarm.condition if reported is None else reported
        return not (alarm.declared_by or condition or alarm.shelved or alarm.out_of_service or alarm.id in self._follow)

    def _own(self, id: str) -> bool:
        return id in self._all and self._all[id].own

    def _required(self) -> set[str]:
        """Return ids of the controllers' alarms that can't be removed."""
        return {alarm.id for alarm in self if not alarm.own and not self._spare(alarm)}

    def _make_room(self, wanted: int, keep: Collection[str] = ()) -> int:
        """Remove the oldest spare alarms, and return how many of the `wanted` ones then have room."""
        full = sum(not alarm.own for alarm in self) + wanted - MOST_ALARMS
        if full > 0:
            spare = [alarm.id for alarm in self if self._spare(alarm) and alarm.id not in keep][:full]
            for id in spare:
                del self._all[id]
            full -= len(spare)
        return wanted - max(full, 0)


def _hint(name: str, known: Iterable[str]) -> str:
    close = get_close_matches(name[:200], known, n=1)
    return f", such as {close[0]}" if close else ""


def _causes(declared: Mapping[str, AlarmFields]) -> dict[str, tuple[str, ...]]:
    return {id: fields.suppressed_by for id, fields in declared.items()}


UNDECLARED = AlarmFields()
"""Fields of an undeclared alarm."""

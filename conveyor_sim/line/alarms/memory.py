# SPDX-License-Identifier: Apache-2.0
"""Alarms in checkpoints, and checks of what a checkpoint file states about them."""

from graphlib import CycleError
from typing import Any, NamedTuple

from conveyor_sim.line.alarms.alarm import ACTIVE, HIDDEN, NEVER, AlarmState, LineAlarm, Shelving, ticks
from conveyor_sim.line.alarms.alarms import UNDECLARED, Alarms
from conveyor_sim.line.alarms.declaration import MOST_ALARMS, as_text, fields_of
from conveyor_sim.physics.state.snapshot import entries, typed
from conveyor_sim.scene.parts.alarm import LONGEST_DELAY
from conveyor_sim.support.printable import printable


class _StoredAlarm(NamedTuple):
    id: str
    number: int
    own: bool
    declared_by: str
    declared: str
    """JSON, as `declaration.py` reads it; "" for alarms of line and scene, and for undeclared ones."""
    condition: bool
    active: bool
    due: int
    main: int
    shelved: Shelving
    shelved_until: int
    out_of_service: bool
    since: int
    changed_by: str


def snapshot(alarms: Alarms) -> dict[str, Any]:
    """Return all state that lasts from tick to tick, as plain data."""
    return {
        "numbered": alarms.numbered,
        "first": alarms.first,
        "alarms": [
            _StoredAlarm(
                alarm.id,
                alarm.number,
                alarm.own,
                alarm.declared_by,
                "" if alarm.own or not alarm.declared_by else as_text(alarm.fields),
                alarm.condition,
                alarm.active,
                alarm.due,
                int(alarm.main),
                alarm.shelved,
                alarm.shelved_until,
                alarm.out_of_service,
                alarm.since,
                alarm.changed_by,
            )
            for alarm in alarms
        ],
    }


def restore(alarms: Alarms, tick: int, memory: Any) -> None:
    """Restore the alarms of the same line at a tick. Raise ValueError for data that do not fit."""
    name = "line.alarms"
    entries(memory, snapshot(alarms), name)
    numbered = typed(int, memory["numbered"], f"{name}.numbered")
    stored = typed(list[_StoredAlarm], memory["alarms"], f"{name}.alarms")
    first = typed(dict[str, str], memory["first"], f"{name}.first")
    own = [(alarm.id, alarm.number, alarm.declared_by) for alarm in alarms if alarm.own]
    _require([(one.id, one.number, one.declared_by) for one in stored if one.own] == own, "belong to another line")
    _require(len(stored) - len(own) <= MOST_ALARMS, f"are more than {MOST_ALARMS}")
    numbers = [one.number for one in stored]
    _require(numbers == sorted(set(numbers)), "have numbers out of order")
    _require(not stored or (numbers[0] > 0 and numbers[-1] <= numbered), "have a number that was never assigned")
    _require(len({one.id for one in stored}) == len(stored), "have one alarm twice")
    made = [_made(one, tick, alarms) for one in stored]
    known = {alarm.id: alarm for alarm in made}
    for alarm in made:
        _require(all(cause in known for cause in alarm.fields.suppressed_by), f"lack what suppresses {alarm.id}")
    for group, id in first.items():
        _require(id in known and known[id].fields.group == group, "have a first-out alarm that is not in its group")
    try:
        alarms.restored(made, numbered, first)
    except CycleError:
        raise ValueError(f"{name} have an alarm that suppresses itself") from None
    for alarm in made:
        shown = AlarmState.NORMAL if alarm.hidden else alarm.main
        fits = alarm.active == (shown in ACTIVE) or alarm.hidden
        _require(fits and shown is alarm.main, f"have one, {printable(alarm.id, 50)}, in an impossible state")
    for group in first:
        here = [alarm.main for alarm in made if alarm.fields.group == group]
        _require(any(main is not AlarmState.NORMAL for main in here), "have a first-out without an alarm")


def _made(one: _StoredAlarm, tick: int, alarms: Alarms) -> LineAlarm:
    """Return an alarm from a file."""
    what = f"have one, {printable(one.id, 50)}, that"
    texts = (one.id, one.declared_by, one.changed_by)
    _require(all(text == printable(text) for text in texts) and one.id != "", f"{what} has invalid texts")
    if one.own:
        fields = alarms[one.id].fields
    else:
        read = fields_of(one.declared) if one.declared_by else UNDECLARED
        if isinstance(read, str) or bool(one.declared_by) != bool(one.declared):
            raise ValueError(f"line.alarms {what} has an invalid declaration")
        fields = read
    alarm = LineAlarm(one.id, one.number, fields, one.declared_by, one.own, alarms.tick)
    alarm.condition, alarm.active, alarm.due = one.condition, one.active, one.due
    alarm.shelved, alarm.shelved_until, alarm.out_of_service = one.shelved, one.shelved_until, one.out_of_service
    alarm.since, alarm.changed_by = one.since, one.changed_by
    _require(one.main in frozenset(AlarmState) - HIDDEN, f"{what} is in an impossible state")
    alarm.main = AlarmState(one.main)
    longest = ticks(LONGEST_DELAY, alarms.tick)
    _require((one.due == NEVER) == (one.condition == one.active), f"{what} has a delay without a reason")
    _require(one.due == NEVER or tick < one.due <= tick + longest, f"{what} has an impossible delay")
    _require((one.shelved == "timed") == (one.shelved_until != NEVER), f"{what} is shelved without a time")
    _require(one.shelved_until == NEVER or tick < one.shelved_until <= tick + longest, f"{what} is shelved too long")
    _require(0 <= one.since <= tick, f"{what} changed after the checkpoint")
    return alarm


def _require(true: bool, text: str) -> None:
    if not true:
        raise ValueError(f"line.alarms {text}")

# SPDX-License-Identifier: Apache-2.0
"""Operator actions on alarms: acknowledge, confirm, reset, shelve, unshelve, remove from service and return to it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from conveyor_sim.columns.events import Kind
from conveyor_sim.line.alarms.alarm import (
    ACKNOWLEDGED,
    ACKNOWLEDGED_UNCONFIRMED,
    CONFIRMED,
    NEVER,
    RESET,
    LineAlarm,
    ticks,
)
from conveyor_sim.line.alarms.alarms import Alarms
from conveyor_sim.scene.parts.alarm import LONGEST_DELAY, PREFIX
from conveyor_sim.support.printable import printable

LISTED = 20
"""Largest number of ids that a refusal lists."""


@dataclass(frozen=True)
class AlarmOperation:
    """Operator action on alarms."""

    kind: Kind
    """Kind of the resulting event."""
    can: Callable[[LineAlarm], bool]
    expected: str
    """Alarms that the action applies to, in words."""
    do: Callable[[LineAlarm], None]
    all_of_them: bool = False
    """True if the action without names applies to all alarms that it can be applied to."""


def _acknowledge(alarm: LineAlarm) -> None:
    alarm.main = (ACKNOWLEDGED_UNCONFIRMED if alarm.fields.confirm else ACKNOWLEDGED)[alarm.main]


def _confirm(alarm: LineAlarm) -> None:
    alarm.main = CONFIRMED[alarm.main]


def _reset(alarm: LineAlarm) -> None:
    alarm.main = RESET[alarm.main]


def _unshelve(alarm: LineAlarm) -> None:
    alarm.shelved, alarm.shelved_until = "", NEVER


def _remove(alarm: LineAlarm) -> None:
    alarm.out_of_service = True


def _return(alarm: LineAlarm) -> None:
    alarm.out_of_service = False


def _shelve(alarm: LineAlarm) -> None:
    alarm.shelved, alarm.shelved_until = "one_shot", NEVER


OPERATIONS = {
    "acknowledge": AlarmOperation(
        "alarm_acknowledged",
        lambda alarm: alarm.main in ACKNOWLEDGED,
        "one that waits to be acknowledged",
        _acknowledge,
        all_of_them=True,
    ),
    "confirm": AlarmOperation(
        "alarm_confirmed",
        lambda alarm: alarm.main in CONFIRMED,
        "one that is acknowledged and waits to be confirmed",
        _confirm,
        all_of_them=True,
    ),
    "reset": AlarmOperation(
        "alarm_reset",
        lambda alarm: alarm.main in RESET,
        "one that has latched, whose condition is gone and that is acknowledged",
        _reset,
        all_of_them=True,
    ),
    "shelve": AlarmOperation("alarm_shelved", lambda alarm: not alarm.out_of_service, "one in service", _shelve),
    "unshelve": AlarmOperation(
        "alarm_unshelved", lambda alarm: bool(alarm.shelved), "one that is shelved", _unshelve, all_of_them=True
    ),
    "remove_from_service": AlarmOperation(
        "alarm_out_of_service", lambda alarm: not alarm.out_of_service, "one in service", _remove
    ),
    "return_to_service": AlarmOperation(
        "alarm_in_service", lambda alarm: alarm.out_of_service, "one that is out of service", _return
    ),
}
"""Actions by name."""


def argument_problem(name: str, ids: Sequence[str], values: Sequence[float]) -> str:
    """Return why an operation can't be done with such arguments in any state of the alarms; "" if it can.

    `problem` documents the arguments.
    """
    if values and (name != "shelve" or len(values) != len(ids)):
        expected = f"one per name ({len(ids)}), or none" if name == "shelve" else "none"
        return f"{len(values)} values given, expected {expected}"
    for value in values:
        if not 0.0 <= value <= LONGEST_DELAY:
            return f"{value:g} given, expected a shelving time of 0 to {LONGEST_DELAY} s"
    if not ids and not OPERATIONS[name].all_of_them:
        return "no name given, expected the id of an alarm"
    return ""


def problem(alarms: Alarms, name: str, ids: Sequence[str], values: Sequence[float]) -> str:
    """Return why an operation can't be done now, "" if it can.

    ids: with or without `alarms/`. values: shelving time of each id, s; 0 or no values: until the condition next ends.
    """
    if reason := argument_problem(name, ids, values):
        return reason
    operation, seen = OPERATIONS[name], set[str]()
    for id in _bare(ids):
        if id not in alarms:
            return f"{printable(id)}: no such alarm, expected {_listed(alarms)}"
        if id in seen:
            return f"{id}: given twice"
        seen.add(id)
        if not operation.can(alarms[id]):
            return f"{id}: is {_words(alarms[id])}, expected {operation.expected}"
    return ""


def perform(alarms: Alarms, name: str, ids: Sequence[str], values: Sequence[float], by: str, tick: int) -> None:
    """Do an operation that `problem` accepts.

    by: the writer.
    """
    operation = OPERATIONS[name]
    chosen = [alarms[id] for id in _bare(ids)] if ids else [alarm for alarm in alarms if operation.can(alarm)]
    for index, alarm in enumerate(chosen):
        operation.do(alarm)
        if values and values[index]:
            alarm.shelved, alarm.shelved_until = "timed", tick + max(1, ticks(values[index], alarms.tick))
            alarms.watch(alarm)
        alarm.changed_by = by
        alarms.note(tick, operation.kind, alarm, f"by {by}")
    if chosen:
        alarms.settle(tick, chosen)


def _bare(ids: Sequence[str]) -> list[str]:
    return [id.removeprefix(PREFIX) for id in ids]


def _words(alarm: LineAlarm) -> str:
    return alarm.state.name.lower().replace("_", " ")


def _listed(alarms: Alarms) -> str:
    if not len(alarms):
        return "none: there are none"
    ids = [alarm.id for alarm in alarms]
    others = f" and {len(ids) - LISTED} others" if len(ids) > LISTED else ""
    return f"one of {', '.join(ids[:LISTED])}{others}"

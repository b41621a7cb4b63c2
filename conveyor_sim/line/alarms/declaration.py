# SPDX-License-Identifier: Apache-2.0
"""Declarations of alarms in inputs: an id, and a JSON object with the fields of an alarm in a scene."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from graphlib import TopologicalSorter
from typing import NamedTuple

from conveyor_sim.scene.part import part_from
from conveyor_sim.scene.parts.alarm import MOST_CAUSES, AlarmFields, id_problem
from conveyor_sim.support.printable import SENTENCE, printable

MOST_ALARMS = 1000
"""Largest number of controllers' alarms at one time, declared or raised undeclared, beside those of line and scene."""

LONGEST_TEXT = 20_000
"""Largest number of characters in one declaration."""


class Declared(NamedTuple):
    """Declared alarm."""

    id: str
    fields: AlarmFields


LINE_GROUP = "line"
"""Group of the line's own alarms."""


def error(id: str, text: str, tag: str, causes: Sequence[str] = ()) -> Declared:
    """Return the line's alarm for a device that has stopped working.

    tag: the signal that shows it. causes: ids of alarms that suppress it.
    """
    shown = tuple(causes)[:MOST_CAUSES]
    return Declared(id, AlarmFields(text=text, alarm_class="error", tag=tag, suppressed_by=shown, group=LINE_GROUP))


def as_sent(text: str) -> str:
    """Return a declaration for recording: unprintable characters escaped, too long texts shortened."""
    return printable(text.translate(_SPACES), LONGEST_TEXT + 1)


_SPACES = str.maketrans("\n\r\t", "   ")


def parse(ids: Sequence[str], texts: Sequence[str]) -> list[Declared] | str:
    """Return the declarations in an input, or why they can't be read: field, value, expectation."""
    if not ids or len(ids) != len(texts):
        return f"{len(ids)} ids and {len(texts)} declarations of alarms given, expected as many of each, at least one"
    if len(ids) > MOST_ALARMS:
        return f"{len(ids)} alarms declared in one input, expected {MOST_ALARMS} at most"
    declared = []
    for id, text in zip(ids, texts, strict=True):
        if problem := id_problem(id):
            return f"alarm {printable(id)}: {problem}"
        fields = fields_of(text)
        if isinstance(fields, str):
            return f"alarm {id}: {fields}"
        declared.append(Declared(id, fields))
    if twice := [id for id, times in Counter(ids).items() if times > 1]:
        return f"alarm {twice[0]}: declared twice in one input"
    return declared


def fields_of(text: str) -> AlarmFields | str:
    """Return the fields in a JSON object, or why it can't be read."""
    if len(text) > LONGEST_TEXT:
        return f"{len(text)} characters given, expected {LONGEST_TEXT} at most"
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        return f"{printable(text, 80)} given, expected a JSON object ({printable(error, 80)})"
    made = part_from(AlarmFields, data)
    if isinstance(made, str):
        return printable(made, SENTENCE)
    for field, problem in made.wrong():
        return f"{field}: {problem}"
    return made


def as_text(fields: AlarmFields) -> str:
    """Return fields as a JSON object, without those at their defaults."""
    return json.dumps(fields.model_dump(mode="json", exclude_defaults=True), ensure_ascii=False)


def ranks(suppressed_by: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Return the length of the longest chain of suppressing alarms that leads to each id. Causes come first.

    suppressed_by: causes by id; all of them are keys. Raise graphlib.CycleError for a circle; its second argument lists
    the ids, with the first one repeated at the end.
    """
    rank: dict[str, int] = {}
    for id in TopologicalSorter(suppressed_by).static_order():
        rank[id] = max((rank[cause] + 1 for cause in suppressed_by[id]), default=0)
    return rank

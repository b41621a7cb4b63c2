"""Declarations of alarms as they travel: an id, and a JSON object with the fields that a scene has for one."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from graphlib import TopologicalSorter
from typing import NamedTuple

from conveyor_sim.scene.part import part_from
from conveyor_sim.scene.parts.alarm import AlarmFields, id_problem
from conveyor_sim.support.printable import SENTENCE, printable

MOST_ALARMS = 1000
"""That controllers have at once, beside those of the line and the scene: declared, or raised without a declaration."""

LONGEST_TEXT = 20_000
"""Characters of one declaration."""


class Declared(NamedTuple):
    """An alarm that is declared."""

    id: str
    fields: AlarmFields


LINE_GROUP = "line"
"""Group of the line's own alarms."""


def error(id: str, text: str, tag: str) -> Declared:
    """An alarm of the line that a device has stopped doing its work. tag: the signal that shows it."""
    return Declared(id, AlarmFields(text=text, alarm_class="error", tag=tag, group=LINE_GROUP))


def as_sent(text: str) -> str:
    """A declaration fit to be kept and recorded: as it came, but for what does not print, and for what is too long."""
    return printable(text.translate(_SPACES), LONGEST_TEXT + 1)


_SPACES = str.maketrans("\n\r\t", "   ")


def parse(ids: Sequence[str], texts: Sequence[str]) -> list[Declared] | str:
    """What an input declares, or why it can't be read: field, value, what was expected."""
    if not ids or len(ids) != len(texts):
        return f"{len(ids)} ids and {len(texts)} declarations of alarms given, expected as many of both, one at least"
    if len(ids) > MOST_ALARMS:
        return f"{len(ids)} alarms declared in one input, expected {MOST_ALARMS} at most"
    found = []
    for id, text in zip(ids, texts, strict=True):
        if problem := id_problem(id):
            return f"alarm {printable(id)}: {problem}"
        fields = fields_of(text)
        if isinstance(fields, str):
            return f"alarm {id}: {fields}"
        found.append(Declared(id, fields))
    if twice := [id for id, times in Counter(ids).items() if times > 1]:
        return f"alarm {twice[0]}: declared twice in one input"
    return found


def fields_of(text: str) -> AlarmFields | str:
    """What a JSON object declares, or why it can't be read."""
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
    """The JSON object of some fields, those that are as by default left out."""
    return json.dumps(fields.model_dump(mode="json", exclude_defaults=True), ensure_ascii=False)


def ranks(suppressed_by: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Of each id, how many follow one from another up to it; causes come before what they suppress.

    suppressed_by: of each id, ids that are all among the keys. Raises graphlib.CycleError, whose second argument is the
    ids of a circle, from one to the same.
    """
    found: dict[str, int] = {}
    for id in TopologicalSorter(suppressed_by).static_order():
        found[id] = max((found[cause] + 1 for cause in suppressed_by[id]), default=0)
    return found

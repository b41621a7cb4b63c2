# SPDX-License-Identifier: Apache-2.0
"""Tables of fields in docs/scene.md and docs/parts/, generated from the schema."""

from collections import Counter
from collections.abc import Iterator, Sequence
from inspect import getdoc
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from conveyor_sim.scene import accuracy, belts, contacts, drives, failures, limits, schema, vibration
from conveyor_sim.scene.layout import parts
from conveyor_sim.scene.layout.devices import PLACEABLE
from conveyor_sim.scene.parts import machine, source, star, work
from conveyor_sim.scene.units import UNITS
from conveyor_sim.scene.words import expectation, field_names, in_yaml

PAGES: dict[str, tuple[str, ...]] = {
    "along": ("Along a conveyor:",),
    "axes": ("`axes`",),
    "failures": ("`failures`", "Times of a failure", "`planned_stops`"),
    "stations": ("`kind: station`", "of a station"),
    "belts": ("`drives`", "`belts`", "curved belt", "path belt", "of a belt", "`plates`"),
    "accuracy": ("`accuracy`", "`outputs`", "`limits`"),
    "alarms": ("`alarms`",),
    "bottles": ("`bottles`", "`grid`"),
    "conveyors": ("`path`", "`lanes`", "`sections`", "`conveyors`"),
    "guides": ("`guides`", "`open`"),
    "indicators": ("`indicators`",),
    "infeeds": ("`infeeds`", "`outfeeds`", "`spills`"),
    "machines": ("`machines`", "`acting_times`", "`layer` of a source"),
    "materials": ("`contacts`", "of a contact", "`base`", "`floor`", "`bottle_types`"),
    "dividers": ("`dividers`", "`adjustable`"),
    "movers": ("`gates`", "`pushers`", "`diverters`", "`clamps`"),
    "panel": ("`panel`",),
    "photo_eyes": ("`photo_eyes`",),
    "rails": ("`rails`",),
    "carousels": ("`carousels`",),
    "screws": ("`screws`",),
    "side_belts": ("`side_belts`",),
    "stars": ("`stars`", "`guide` of a star wheel"),
    "zones": ("`zones`", "`counters`"),
}
"""Pages of docs/parts/ with fields. A section is on the first page with a part of its title, else in docs/scene.md."""

RULES = (
    ("a name", "a name of at most 100 letters, digits and underscores, beginning with a letter"),
    ("a point", "a point [x, y] of two numbers within +-100000"),
    ("an angle", 'an angle, a number or a text like "90 deg"'),
    ("a station", 'a number, negative from the end, or "end"'),
)
"""Short and full form of expectations that many fields have. docs/scene.md states the full form once."""

WITHIN: dict[str, list[tuple[str, type[BaseModel]]]] = {
    "accuracy": [("`accuracy`", accuracy.Accuracy)],
    "contacts": [
        ("An entry of `contacts`", contacts.Contact),
        ("`damping` of a contact", contacts.Damping),
        ("`tangential` of a contact", contacts.Tangential),
    ],
    "base": [("An entry of `base`", contacts.Base), ("`tangential` of an entry of `base`", contacts.BaseSpring)],
    "floor": [("`floor`", schema.Floor)],
    "bottles": [
        ("An entry of `bottles`: one bottle", schema.Single),
        ("An entry of `bottles`: a grid", schema.Grid),
        ("`grid`", schema.GridOfBottles),
    ],
    "outputs": [("`outputs`", schema.Outputs)],
    "limits": [("`limits`", limits.Limits)],
}
"""Sections of fields other than mappings of names to parts, by field."""

BEHIND: dict[str, list[tuple[str, type[BaseModel]]]] = {
    "belts": [
        ("`rails` of a curved belt", belts.BeltRails),
        ("An entry of `surfaces` of a path belt: `kind: straight`", belts.StraightSurface),
        ("An entry of `surfaces` of a path belt: `kind: curved`", belts.CurvedSurface),
        ("`drive` of a belt", drives.Drive),
        ("`vibration` of a belt", vibration.ChainVibration),
    ],
    "stars": [("`guide` of a star wheel", star.StarGuide)],
    "machines": [
        ("`acting_times` of a machine", machine.ActingTimes),
        ("`layer` of a source", source.Layer),
        ("An entry of `failures` of a machine", failures.Failure),
        ("Times of a failure: `kind: exponential`", failures.Exponential),
        ("Times of a failure: `kind: weibull`", failures.Weibull),
        ("Times of a failure: `kind: list`", failures.FixedTimes),
        ("An entry of `planned_stops` of a machine", failures.PlannedStop),
        ("An entry of `sets` of a station", work.AttributeRule),
        ("An entry of `tests` of a station", work.Acceptance),
    ],
}
"""Sections that follow those of a mapping's parts."""


LAYOUT: list[tuple[str, type[BaseModel]]] = [
    ("The whole file: layout", parts.SceneLayout),
    ("An entry of `conveyors`", parts.Conveyor),
    ("An entry of `path` of a conveyor", parts.Move),
    ("An entry of `lanes` of a conveyor", parts.ConveyorLane),
    ("An entry of `sections` of a conveyor", parts.ConveyorSection),
    ("`guides` of a conveyor", parts.ConveyorGuides),
    ("An entry of `guides`", parts.Guide),
    ("`open` of guides", parts.Openings),
]
"""Sections of the layout, which becomes belts and rails."""


def sections() -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield title and model of each section, in the order of the fields of a scene."""
    yield "The whole file", schema.Scene
    for name, field in schema.Scene.model_fields.items():
        yield from WITHIN.get(name, [])
        for model in _models(field.annotation) if name not in WITHIN else ():
            kind = model.model_fields.get("kind")
            of_kind = "" if kind is None else f": `kind: {get_args(kind.annotation)[0]}`"
            yield f"An entry of `{name}`{of_kind}", model
        yield from BEHIND.get(name, [])
    yield from LAYOUT
    yield from _places()


def _places() -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield title and model of the places along conveyors; kinds with the same fields are one section."""
    titles: dict[type[BaseModel], list[str]] = {}
    for kind in PLACEABLE:
        field = f"`{kind.within}` of `{kind.field}`" if kind.within else f"`{kind.field}`"
        titles.setdefault(kind.place, []).append(field + (f" of `kind: {kind.kind}`" if kind.kind else ""))
    yield from ((f"Along a conveyor: {', '.join(dict.fromkeys(texts))}", model) for model, texts in titles.items())


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the parts that a mapping of names may hold; none for other types."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is Annotated:
        yield from _models(get_args(annotation)[0])
    elif get_origin(annotation) is dict:
        yield from _models(get_args(annotation)[1])
    elif get_origin(annotation) in (Union, UnionType):
        for one in get_args(annotation):
            yield from _models(one)


def tables() -> dict[str, dict[str, str]]:
    """Return the generated parts of pages by their names; pages by their path in docs/ without suffix."""
    whole = ("The whole file", schema.Scene), ("The whole file: layout", parts.SceneLayout)
    pages = {f"parts/{page}": {"fields": _fields(_sections_of(page))} for page in PAGES}
    pages["scene"] = {
        "units": "The units are " + ", ".join(f"`{name}`" for name in UNITS if name.isascii()) + ".",
        "rules": "\n".join(["| word | full rule |", "|---|---|", *(f"| {word} | {rule} |" for word, rule in RULES)]),
        "fields": _fields(whole),
        "others": _fields([section for section in _sections_of(None) if section not in whole]),
    }
    return pages


def page_of(title: str) -> str | None:
    """Return the page of docs/parts/ with the section of this title; None: docs/scene.md has it."""
    return next((page for page, words in PAGES.items() if any(word in title for word in words)), None)


def _sections_of(page: str | None) -> list[tuple[str, type[BaseModel]]]:
    return [section for section in sections() if page_of(section[0]) == page]


def _fields(of: Sequence[tuple[str, type[BaseModel]]]) -> str:
    """Return the sections of a page. One table, before the sections, has the rows that several sections share.

    It has at most one row per name of a field: the most frequent one.
    """
    rows = {title: _rows(model) for title, model in of}
    counts = Counter(row for table in rows.values() for row in table.values())
    shared: dict[str, str] = {}
    for name, row in (item for table in rows.values() for item in table.items()):
        if counts[row] > max(1, counts[shared.get(name, "")]):
            shared[name] = row
    lines = ["### Shared fields", "", *_table(list(shared.values())), ""] if shared else []
    for title, model in of:
        own = [row for name, row in rows[title].items() if shared.get(name) != row]
        others = [f"`{name}`" for name, row in rows[title].items() if shared.get(name) == row]
        lines += [f"### {title}", "", getdoc(model) or "", ""]
        lines += [*_table(own), ""] if own else []
        lines += [f"[Shared fields](#shared-fields): {', '.join(others)}.", ""] if others else []
    return "\n".join(lines)


def _table(rows: Sequence[str]) -> list[str]:
    return ["| field | takes | default | meaning |", "|---|---|---|---|", *rows]


def _rows(model: type[BaseModel]) -> dict[str, str]:
    """Return the rows of a model by field: `kind` first, then required fields, then all others."""
    fields = sorted(field_names(model).items(), key=lambda item: (item[0] != "kind", not item[1].is_required()))
    return {name: _row(name, field) for name, field in fields}


def _row(name: str, field: FieldInfo) -> str:
    takes = expectation(field)
    for word, rule in RULES:
        takes = takes.replace(rule, word)
    return f"| `{name}` | {takes} | {_default(field)} | {field.description} |"


def _default(field: FieldInfo) -> str:
    default = field.default
    if field.is_required():
        return "required"
    if default is None or default == "":
        return "left out"
    if isinstance(default, BaseModel):
        return "as below"
    return f"`{in_yaml(default)}`" if default or not isinstance(default, (tuple, dict)) else "empty"

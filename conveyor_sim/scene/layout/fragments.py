# SPDX-License-Identifier: Apache-2.0
"""`Fragment`: data of a scene or a cell with the origins of its parts, and the joining of two of them."""

from collections.abc import Callable
from typing import Any, get_origin

from conveyor_sim.scene.layout.parameters import names_in
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.provenance import FieldPlace, Sources
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown

LISTS = ("contacts", "base", "bottles")
"""Lists of a scene that join. Equal entries are stored once, except those of `bottles`."""
SHARED = "bottle_types"
"""Named parts without a prefix. Equal ones may be given several times."""

_TWICE = "given twice, first at {}, expected one of them"

Report = Callable[[FieldPlace, str], None]
"""Called with the place of a problem, and the words that follow its path."""


SINGLE = frozenset(
    name
    for name, field in Scene.model_fields.items()
    if name == "effects" or (get_origin(field.annotation) is not dict and name not in LISTS)
)
"""Fields of a scene that are given once. All others are mappings of names to parts, which join."""


class Fragment:
    """Data of a file with those of the files that it includes."""

    def __init__(self, sources: Sources, data: dict[Any, Any]) -> None:
        self.sources = sources
        self.data = data
        self._equal: dict[str, set[str]] = {}

    def place_of(self, path: Path) -> FieldPlace:
        """Return the place of a field, or of the nearest one above it."""
        return self.sources.place_of(path)

    def join(self, other: "Fragment", field: Any, report: Report) -> None:
        """Add a field of another fragment, or another part of the same file."""
        value = other.data[field]
        if field not in self.data:
            joins = isinstance(value, list) if field in LISTS else isinstance(value, dict) and field not in SINGLE
            if not joins:
                self.data[field] = value
                self.sources.adopt((field,), other.sources, (field,))
                return
            self.data[field] = type(value)()
            self.sources.add((field,), *other.sources.origin_of((field,)))
        present = self.data[field]
        if field in LISTS and isinstance(present, list) and isinstance(value, list):
            self._extend(other, field, present, value)
        elif field not in SINGLE and isinstance(present, dict) and isinstance(value, dict):
            for name, part in value.items():
                self._add(other, field, name, part, report)
        elif field in SINGLE:
            report(other.place_of((field,)), _TWICE.format(self.place_of((field,))))
        else:
            kind = list if field in LISTS else dict
            wrong, owner = (value, other) if isinstance(present, kind) else (present, self)
            expected = "a list" if field in LISTS else "a mapping of names to parts"
            report(owner.place_of((field,)), f"{shown(wrong)} given, expected {expected}")
            if owner is self:
                self.data[field] = kind()  # reported once, however many files join

    def _extend(self, other: "Fragment", field: str, present: list[Any], new: list[Any]) -> None:
        equal = self._equal.setdefault(field, set())
        for index, entry in enumerate(new):
            text = _key(entry)
            if field != "bottles" and text in equal:
                continue
            equal.add(text)
            self.sources.adopt((field, len(present)), other.sources, (field, index))
            present.append(entry)

    def _add(self, other: "Fragment", field: Any, name: Any, part: Any, report: Report) -> None:
        present = self.data[field]
        if name not in present:
            present[name] = part
            self.sources.adopt((field, name), other.sources, (field, name))
        elif field != SHARED or _key(present[name]) != _key(part):
            first = self.place_of((field, name))
            text = f"another definition given, expected that of {first}" if field == SHARED else _TWICE.format(first)
            report(other.place_of((field, name)), text)


def _key(value: Any) -> str:
    """Return a text that is equal for equal data. Parameters in texts count by their values."""
    if isinstance(value, dict):
        return "{" + ",".join(sorted(f"{key!r}:{_key(item)}" for key, item in value.items())) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(_key, value)) + "]"
    scope = getattr(value, "scope", {})
    values = [scope[name] for name in names_in(value) if name in scope] if scope else []
    return repr((str(value), values)) if values else repr(str(value) if isinstance(value, str) else value)

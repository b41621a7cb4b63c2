# SPDX-License-Identifier: Apache-2.0
"""Composition of a scene: its file with included files, a variant, a format, parameters and cells as one mapping."""

import posixpath
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.beside import Beside
from conveyor_sim.scene.layout.cells import (
    WITH_PORTS,
    CellFault,
    EntryFault,
    Port,
    entry_faults,
    file_faults,
    joined,
    ports_of,
)
from conveyor_sim.scene.layout.choices import set_bottle, with_choices
from conveyor_sim.scene.layout.expanded_parts import expanded_parts
from conveyor_sim.scene.layout.fragments import LISTS, Fragment
from conveyor_sim.scene.layout.parameters import Scope, scope_of, scoped, unknown, with_value
from conveyor_sim.scene.overrides import holds, merged
from conveyor_sim.scene.problem_count import MOST_SAID
from conveyor_sim.scene.problems import Path, Problem, dotted
from conveyor_sim.scene.provenance import FieldPlace, SceneFile, Sources, inside
from conveyor_sim.scene.quantities import Scoped
from conveyor_sim.scene.refusal import refused
from conveyor_sim.scene.words import did_you_mean, shown
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.support.files import in_mb

_MOST_FILES = 1000
MOST_NESTED = 20
"""Largest number of files that include each other, or of cells in cells."""


class Files:
    """Files that a scene includes or uses as cells: read once, with limits on their number and size."""

    def __init__(self, beside: Beside, scene: str) -> None:
        """scene: name of the scene's file for errors."""
        self._beside, self._folder = beside, posixpath.dirname(scene)
        self.main = posixpath.basename(scene)
        """Path of the scene from its folder."""
        self._documents: dict[str, Document] = {}
        self._size = 0

    def key(self, path: str, beside: str) -> str:
        """Return a path from the scene's folder. path: as written; beside: the file that it is written in."""
        return posixpath.normpath(posixpath.join(posixpath.dirname(beside), path))

    def name(self, key: str) -> str:
        """Return the name of a file for errors."""
        return posixpath.join(self._folder, key)

    def document(self, key: str, kind: str) -> Document:
        """Return a parsed file. kind: words for the error. Raise ValueError if it can't be read, or SceneError."""
        if key not in self._documents:
            if len(self._documents) >= _MOST_FILES:
                raise ValueError(f"expected at most {_MOST_FILES} files in a scene")
            content, _ = self._beside.read(key, LONGEST_TEXT, kind)
            self._size += len(content)
            if self._size > LONGEST_TEXT:
                raise ValueError(f"expected files of at most {in_mb(LONGEST_TEXT)} together")
            try:
                text = content.decode("utf-8")
            except UnicodeDecodeError:
                raise ValueError(f"expected {kind} in UTF-8") from None
            document = Document(text, self.name(key))
            if not isinstance(document.data, dict):
                raise ValueError(f"expected {kind}, a mapping of fields of a scene")
            self._documents[key] = document
        return self._documents[key]


LANGUAGE = ("include", "parameters", "cells", "ports", "variants", "formats", "variant", "format")
"""Fields of a scene file that a composed scene no longer has."""
_UNSCOPED = ("parameters", "ports", "variants", "formats", "variant", "format")
"""Fields whose texts do not refer to the parameters of the file, or do so before the others."""
_FIRST = ("include", "variants", "formats")
"""Fields whose overrides decide which others there are."""
_MOST_VALUES = 250_000
"""Largest number of values in all cells of a scene."""


@dataclass
class Composition:
    """Composed data of a scene, and the places of their fields."""

    data: Any
    sources: Sources
    is_composed: bool = False
    """True if the file has fields of LANGUAGE."""


def compose(document: Document, name: str, changes: dict[str, Any], beside: Beside) -> Composition:
    """Return the data of a scene with its overrides. Raise SceneError with one line per problem.

    name: of the scene's file; changes: plain overrides; beside: place of the files that it names.
    """
    if uses_language(document.data, changes):
        composer = _Composer(name, changes, beside)
        fragment = composer.scene(document)
        return Composition(fragment.data, fragment.sources, True)
    data, sources = document.data, Sources(SceneFile(name, document), changes)
    if changes:
        if refusals := [Problem(path, text) for path, text in expanded_parts(data, changes)]:
            raise refused(refusals, sources.place_of, name)
        data = merged(data, changes)
    return Composition(data, sources)


def uses_language(data: Any, changes: Mapping[str, Any]) -> bool:
    """Return True if a scene or its overrides have fields that composition replaces."""
    return isinstance(data, dict) and any(field in data or field in changes for field in LANGUAGE)


def chosen(document: Document, name: str, changes: dict[str, Any], beside: Beside) -> Any:
    """Return the data of a scene with includes, variant, format and overrides, in which paths of overrides start.

    Raise SceneError. See `compose`.
    """
    if uses_language(document.data, changes):
        return _Composer(name, changes, beside).chosen(document).data
    return merged(document.data, changes)


class _Composer:
    """Composition of one scene."""

    def __init__(self, name: str, changes: dict[str, Any], beside: Beside) -> None:
        self._name = name
        self._changes = changes
        self._files = Files(beside, name)
        self._problems: list[tuple[FieldPlace, str]] = []
        self._size = 0

    def scene(self, document: Document) -> Fragment:
        """Return the composed data of a scene. Raise SceneError."""
        fragment = self.chosen(document)
        composed, _ = self._composed(
            fragment, (self._files.main,), {}, lambda path: self._parameter_place(fragment, path)
        )
        for field in ("format", "formats"):
            if field in fragment.data:
                composed.data[field] = fragment.data[field]
        set_bottle(composed, self._changes)
        composed.data = {field: value for field, value in composed.data.items() if field not in LANGUAGE}
        self._raise_problems()
        return composed

    def chosen(self, document: Document) -> Fragment:
        """Return the data of a scene with includes, variant, format and overrides. Raise SceneError."""
        file = SceneFile(self._name, document, key=self._files.main)
        written = merged(document.data, {key: value for key, value in self._changes.items() if key in _FIRST})
        fragment = self._with_includes(Fragment(Sources(file, self._changes), written), {file.key}, (file.key,))
        self._raise_problems()
        for path, text in expanded_parts(fragment.data, self._changes):
            self._report(fragment.place_of(path), text)
        with_choices(fragment, self._changes, self._report)
        self._raise_problems()
        return fragment

    def _report(self, place: FieldPlace, text: str) -> None:
        self._problems.append((place, text))
        if len(self._problems) > MOST_SAID:
            self._raise_problems()

    def _raise_problems(self) -> None:
        if self._problems:
            problems = [Problem((index,), text) for index, (_, text) in enumerate(self._problems)]
            raise refused(problems, lambda path: self._problems[int(path[0])][0], self._name)

    def _with_includes(self, own: Fragment, included: set[str], stack: tuple[str, ...]) -> Fragment:
        """Return the data of a file with those of the files that it includes, at the place of `include`.

        included: files so far, each of which is included once; stack: files that include each other.
        """
        result = Fragment(own.sources.empty(), {})
        for field in own.data:
            if field != "include":
                result.join(own, field, self._report)
                continue
            written = own.data["include"]
            for index, path in enumerate(written if isinstance(written, list) else [written]):
                at: Path = ("include", index) if isinstance(written, list) else ("include",)
                part = self._included(own, at, path, included, stack)
                if part is not None:
                    for name in part.data:
                        result.join(part, name, self._report)
        return result

    def _included(
        self, own: Fragment, at: Path, path: Any, included: set[str], stack: tuple[str, ...]
    ) -> Fragment | None:
        file = self._file(own, at, path, stack, "a scene file")
        if file is None or file.key in included:
            return None
        included.add(file.key)
        return self._with_includes(Fragment(Sources(file), self._data_of(file)), included, (*stack, file.key))

    def _file(
        self, own: Fragment, at: Path, path: Any, stack: tuple[str, ...], kind: str, cell: str = ""
    ) -> SceneFile | None:
        """Return a file that a field names; None after a report. stack: files that name each other."""
        place = own.place_of(at)
        if not isinstance(path, str):
            self._report(place, f"{shown(path)} given, expected the path of {kind}, or a list of paths")
            return None
        beside = self._files.main if holds(self._changes, at) else own.sources.origin_of(at)[0].key
        key = self._files.key(path, beside)
        if key in stack:
            chain = " -> ".join([*stack[stack.index(key) :], key])
            self._report(place, f"{shown(path)} given, expected another file: these name each other: {chain}")
            return None
        if len(stack) > MOST_NESTED:
            self._report(place, f"{shown(path)} given, expected at most {MOST_NESTED} files that name each other")
            return None
        try:
            return SceneFile(self._files.name(key), self._files.document(key, kind), cell or own.sources.main.cell, key)
        except ValueError as error:
            self._report(place, f"{shown(path)} given, {error}")
            return None

    def _composed(
        self,
        fragment: Fragment,
        stack: tuple[str, ...],
        values: Mapping[str, Any],
        place_of: Callable[[Path], FieldPlace],
    ) -> tuple[Fragment, dict[str, Port]]:
        """Return the data of a file with parameters in scope and with its cells, and its ports.

        values: of parameters, in place of their defaults; place_of: returns the place of a path in `parameters`.
        """
        entries = fragment.data.get("parameters", {})
        if isinstance(entries, dict):
            entries = entries | {name: with_value(entries[name], value) for name, value in values.items()}
        scope = scope_of(entries, lambda path, text: self._report(place_of(path), text))
        written = {field: value for field, value in fragment.data.items() if field not in _UNSCOPED}
        own = Fragment(fragment.sources, {field: scoped(value, scope) for field, value in written.items()})
        cells = self._cells(own, scope, stack)
        own.data = {field: self._resolved(own, (field,), value, cells) for field, value in own.data.items()}
        result = Fragment(own.sources.empty(), {})
        for field in own.data:
            if field != "cells":
                result.join(own, field, self._report)
                continue
            for name in cells:
                self._join(result, own, name, cells[name])
        try:
            ports = {name: cell.outer_ports for name, cell in cells.items() if cell is not None}
            return result, ports_of(result.data, fragment.data.get("ports", {}), ports)
        except CellFault as fault:
            self._report(fragment.place_of(fault.path), fault.text)
            return result, {}

    def _parameter_place(self, fragment: Fragment, path: Path) -> FieldPlace:
        """Return the place of a path in `parameters`. A value in place of a default has no field `default`."""
        at = ("parameters", *path)
        file, source = fragment.sources.origin_of(at)
        written = self._changes if holds(self._changes, at) else file.document.data
        return fragment.place_of(at if inside(written, at if written is self._changes else source) else at[:2])

    def _cells(self, own: Fragment, scope: Scope, stack: tuple[str, ...]) -> dict[str, "_Cell | None"]:
        """Return the cells of a file by name; None for invalid ones, which are reported."""
        entries = own.data.get("cells", {})
        if not isinstance(entries, dict):
            self._report(own.place_of(("cells",)), f"{shown(entries)} given, expected a mapping of names to cells")
            return {}
        cells: dict[str, _Cell | None] = {}
        for name, entry in entries.items():
            faults = list(entry_faults(name, entry))
            for path, text in faults:
                self._report(own.place_of(("cells", name, *path)), text)
            cells[name] = None if faults else self._cell(own, name, entry, scope, stack)
        return cells

    def _cell(
        self, own: Fragment, name: str, entry: Mapping[str, Any], scope: Scope, stack: tuple[str, ...]
    ) -> "_Cell | None":
        outer = own.sources.main.cell
        file = self._file(
            own, ("cells", name, "use"), str(entry["use"]), stack, "a cell file", f"{outer}.{name}".lstrip(".")
        )
        if file is None:
            return None
        fragment = self._with_includes(Fragment(Sources(file), self._data_of(file)), {file.key}, (*stack, file.key))
        for path, text in file_faults(fragment.data):
            self._report(fragment.place_of(path), text)
        known = fragment.data.get("parameters", {})
        values: dict[str, Any] = {}
        for parameter, value in entry.get("set", {}).items():
            if not isinstance(known, dict) or parameter not in known:
                text = unknown(parameter, known if isinstance(known, dict) else {})
                self._report(own.place_of(("cells", name, "set", parameter)), text)
            else:
                values[parameter] = Scoped(value, scope) if isinstance(value, str) else value

        def place_of(path: Path) -> FieldPlace:
            if path and path[0] in values and path[1:] in ((), ("default",)):
                return own.place_of(("cells", name, "set", path[0]))
            return fragment.place_of(("parameters", *path))

        composed, ports = self._composed(fragment, (*stack, file.key), values, place_of)
        self._size += 1 + _values_in(composed.data)
        if self._size > _MOST_VALUES:
            place = own.place_of(("cells", name))
            raise SceneError(f"{place}: {dotted(place.path)}: more than {_MOST_VALUES} values in cells, expected fewer")
        return _Cell(name, composed, ports)

    def _resolved(self, own: Fragment, path: Path, value: Any, cells: Mapping[str, "_Cell | None"]) -> Any:
        """Return data in which conveyors stand in place of ports of cells."""
        if not cells:
            return value
        if isinstance(value, dict):
            return {key: self._resolved(own, (*path, key), item, cells) for key, item in value.items()}
        if isinstance(value, list):
            return [self._resolved(own, (*path, index), item, cells) for index, item in enumerate(value)]
        fields = [part for part in path[2:] if isinstance(part, str)]
        if not isinstance(value, str) or not fields or fields[-1] not in WITH_PORTS:
            return value
        name, dot, port = value.partition(".")
        if not dot and (name not in cells or name in own.data.get("conveyors", {})):
            return value
        cell = cells.get(name)
        if name in cells and cell is None:
            return value  # reported
        ends = ("end",) if fields[-1] == "after" else ("start", "end")
        if cell is not None and port in cell.ports and cell.ports[port].end in ends:
            return cell.outer_ports[port].conveyor
        others = [cell] if cell is not None else [one for one in cells.values() if one is not None]
        known = [f"{one.name}.{name}" for one in others for name, joint in one.ports.items() if joint.end in ends]
        kind = "no port at an end of a cell" if fields[-1] == "after" else "no port of a cell"
        self._report(own.place_of(path), f"{shown(value)} given, which is {kind}, {did_you_mean(value, known)}")
        return value

    def _join(self, result: Fragment, own: Fragment, name: str, cell: "_Cell | None") -> None:
        """Add a cell to the data of the file that it is used in."""
        if cell is None:
            return
        try:
            part = joined(cell.fragment, name, own.data["cells"][name], own.sources, cell.ports)
        except EntryFault as fault:
            self._report(own.place_of(("cells", name, *fault.path)), fault.text)
        except CellFault as fault:
            self._report(cell.fragment.place_of(fault.path), fault.text)
        else:
            for field in part.data:
                # An override of a list replaces all of it.
                if not (field in LISTS and field in own.sources.changes):
                    result.join(part, field, self._report)

    def _data_of(self, file: SceneFile) -> dict[Any, Any]:
        """Return the data of a file, with paths of tables from the scene's folder."""
        data: dict[Any, Any] = file.document.data
        contacts = data.get("contacts")
        if not isinstance(contacts, list):
            return data
        tables = [
            {**contact, "table": self._files.key(contact["table"], file.key)}
            if isinstance(contact, dict) and isinstance(contact.get("table"), str)
            else contact
            for contact in contacts
        ]
        return {**data, "contacts": tables}


@dataclass(frozen=True)
class _Cell:
    name: str
    fragment: Fragment
    """Composed data without the prefix."""
    ports: Mapping[str, Port]

    @property
    def outer_ports(self) -> dict[str, Port]:
        """Ports with the names that the conveyors have outside the cell."""
        return {name: Port(f"{self.name}_{port.conveyor}", port.end) for name, port in self.ports.items()}


def _values_in(value: Any) -> int:
    if isinstance(value, dict):
        return sum(map(_values_in, value.values()), 1)
    return sum(map(_values_in, value), 1) if isinstance(value, list) else 1

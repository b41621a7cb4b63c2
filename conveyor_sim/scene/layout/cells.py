# SPDX-License-Identifier: Apache-2.0
"""Cells of a scene: entries of `cells`, ports of cell files, and their joining to the scene."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.scene.layout.cell_coordinates import coordinates, placed, si
from conveyor_sim.scene.layout.fragments import SINGLE, Fragment
from conveyor_sim.scene.layout.naming import Prefix
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.provenance import Sources
from conveyor_sim.scene.types import XY
from conveyor_sim.scene.words import did_you_mean, shown

JOIN = ("after", "back", "beside", "side", "from", "gap", "offset", "plate")
"""Fields of an entry of `cells` that are those of the conveyor at its port `in`."""
PLACE = ("start", "heading")
"""Fields of an entry of `cells` that place the origin of its coordinates."""
FIELDS = ("use", "set", *JOIN, *PLACE)
WITH_PORTS = ("after", "beside", "along")
"""Fields that take a port of a cell in place of a conveyor."""
OF_SCENES = ("variants", "formats", "variant", "format")
"""Fields of a scene that a cell file does not have."""

_PORT = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\.(start|end)")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,49}")
_TEXT = "expected the start or the end of a conveyor, such as infeed.start"


@dataclass(frozen=True)
class Port:
    """End of a conveyor at which a cell is joined."""

    conveyor: str
    end: str
    """`start` or `end`."""


Ports = Mapping[str, Mapping[str, Port]]
"""Ports by cell and name."""


class CellFault(Exception):
    """A fault of a cell file, at a path of this file."""

    def __init__(self, path: Path, text: str) -> None:
        super().__init__(text)
        self.path, self.text = path, text


class EntryFault(CellFault):
    """A fault of an entry of `cells`, at a path in this entry."""


def ports_of(data: Mapping[Any, Any], declared: Any, inner: Ports) -> dict[str, Port]:
    """Return the ports of a cell file. Raise CellFault.

    data: of the cell, composed; declared: its field `ports`; inner: ports of cells in it.
    """
    if not isinstance(declared, dict):
        raise CellFault(("ports",), f"{shown(declared)} given, expected a mapping of names to ends of conveyors")
    conveyors = data.get("conveyors", {})
    ports: dict[str, Port] = {}
    for name, value in declared.items():
        if not isinstance(name, str) or not isinstance(value, str):
            raise CellFault(("ports", name), f"{shown(value)} given, {_TEXT}")
        first, _, second = value.partition(".")
        if second in inner.get(first, {}):
            ports[name] = inner[first][second]
        elif (match := _PORT.fullmatch(value)) is None:
            raise CellFault(("ports", name), f"{shown(value)} given, {_TEXT}")
        elif not isinstance(conveyors, dict) or match[1] not in conveyors:
            known = [f"{one}.{match[2]}" for one in conveyors] if isinstance(conveyors, dict) else []
            raise CellFault(("ports", name), f"{shown(value)} given, {did_you_mean(value, known)}")
        else:
            ports[name] = Port(match[1], match[2])
    return ports


def entry_faults(name: Any, entry: Any) -> Iterator[tuple[Path, str]]:
    """Yield faults of an entry of `cells` by itself."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        yield (), f"{shown(name)} given as a name, expected at most 50 letters, digits and underscores after a letter"
    if not isinstance(entry, dict):
        yield (), f"{shown(entry)} given, expected a mapping with the field use"
        return
    for field in entry:
        if field not in FIELDS:
            yield (field,), f"no such field, {did_you_mean(str(field), list(FIELDS))}"
    if not isinstance(entry.get("use"), str):
        yield ("use",), f"{shown(entry.get('use'))} given, expected the path of a cell file"
    if not isinstance(entry.get("set", {}), dict):
        yield ("set",), f"{shown(entry['set'])} given, expected a mapping of parameters of the cell to values"
    if "after" in entry and "beside" in entry:
        yield ("beside",), "given with after, expected one of them"
    joins = [field for field in ("after", "beside") if field in entry]
    for field in PLACE if joins else ():
        if field in entry:
            yield (field,), f"given with {joins[0]}, expected one of them: a joined cell continues the conveyor"
    for field in JOIN if not joins else ():
        if field in entry:
            yield (field,), "given without after or beside, expected one of them, which it belongs to"


def file_faults(data: Mapping[Any, Any]) -> Iterator[tuple[Path, str]]:
    """Yield faults of fields that a cell file does not have."""
    for field in data:
        if field in OF_SCENES or (field in SINGLE and field not in ("name", "description")):
            yield (field,), "given in a cell, expected in the scene: it holds for all of it"


def joined(cell: Fragment, name: str, entry: Mapping[str, Any], outer: Sources, ports: Mapping[str, Port]) -> Fragment:
    """Return a cell as it stands in the scene, with the prefix. Raise CellFault with a path of the cell file.

    name, entry: of the cell; outer: origins of the data in whose field `cells` it is.
    """
    cell = Fragment(cell.sources, {field: parts for field, parts in cell.data.items() if field not in SINGLE})
    prefix = Prefix(name, cell.data)
    if not ("after" in entry or "beside" in entry):
        cell.data = _placed(cell.data, entry, ports.get("in"))
        return prefix.fragment(cell)
    own = _joining(cell.data, ports.get("in"))
    result = prefix.fragment(cell)
    new = prefix.name(own[1])
    moves = {field: value for field, value in entry.items() if field in JOIN}
    part = result.data["conveyors"][new]
    result.data["conveyors"][new] = moves | {key: value for key, value in part.items() if key not in PLACE}
    for field in moves:
        result.sources.add(("conveyors", new, field), *outer.origin_of(("cells", name, field)))
    return result


def _joining(data: Mapping[Any, Any], port: Port | None) -> Path:
    """Return the path of the conveyor with which a cell joins another. Raise CellFault if it can't."""
    if port is None or port.end != "start":
        wrong = "no port in" if port is None else f"{port.conveyor}.{port.end} as port in"
        raise CellFault(("ports",), f"{wrong} given, expected the start of a conveyor: the cell joins another there")
    own = ("conveyors", port.conveyor)
    part = data["conveyors"][port.conveyor]
    if not isinstance(part, dict):
        raise CellFault(own, f"{shown(part)} given, expected a conveyor")
    for field in ("after", "beside"):
        if field in part:
            raise CellFault((*own, field), f"{shown(part[field])} given at the port in, expected none: it joins there")
    for path, _, value in coordinates(data):
        if path[:3] not in ((*own, "start"), (*own, "heading")):
            text = f"{shown(value)} given in a cell that joins another conveyor, expected along, after or beside; "
            raise CellFault(path, f"{text}cells with coordinates are placed by start and heading")
    return own


def _placed(data: dict[Any, Any], entry: Mapping[str, Any], port: Port | None) -> dict[Any, Any]:
    """Return the data of a cell turned and shifted to its place."""
    if not any(field in entry for field in PLACE):
        return data
    part = data["conveyors"][port.conveyor] if port is not None and port.end == "start" else None
    if port is not None and isinstance(part, dict) and not any(field in part for field in (*JOIN, "start", "points")):
        part = {"start": [0.0, 0.0], "heading": 0.0, **part}
        data = {**data, "conveyors": {**data["conveyors"], port.conveyor: part}}
    return placed(data, *_frame(entry))


def _frame(entry: Mapping[str, Any]) -> tuple[XY, float]:
    """Return the place (m) and direction (rad) of a cell. Raise EntryFault."""
    start, heading = entry.get("start", [0.0, 0.0]), entry.get("heading", 0.0)
    try:
        if not isinstance(start, list) or len(start) != 2:
            raise ValueError("expected a point [x, y] (m)")
        x, y = (si(value, "m") for value in start)
    except ValueError as error:
        raise EntryFault(("start",), f"{shown(start)} given, {error}") from None
    try:
        return (x, y), si(heading, "rad")
    except ValueError as error:
        raise EntryFault(("heading",), f"{shown(heading)} given, {error}") from None

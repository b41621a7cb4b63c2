# SPDX-License-Identifier: Apache-2.0
"""Map of our tags to those of a PLC: a CSV file with the columns `tag` and `theirs`.

    tag,theirs
    photo_eyes/full1/blocked,ns=4;s=GVL.Full1
    belts/zone1/cmd_speed,ns=4;s=GVL.Speed1
    alarms/jam at the outfeed,ns=4;s=GVL.Jam

Signals are written to the PLC. Commands, and alarms that the PLC raises, are read from it. Other values of the PLC,
such as a state or a counter, have names that begin with `plc/`; conditions of a test may read them.

`theirs` is a NodeId of OPC UA, or a place in Modbus: table, address, type, word order ("holding register 12 float32
big"), a place in a Siemens PLC ("DB1.DBD4 REAL"), a tag of a Rockwell PLC, or a symbol of a Beckhoff PLC.
A third column, `note`, is for the reader. Rows without a tag are ignored: `attach URL --browse` writes them.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.refusal import ALARMS
from conveyor_sim.line.tag import CONTROLLED, PANEL, SIGNALS, Tag, count, switch
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable

COLUMNS = ("tag", "theirs")
NOTE = "note"

OWN = "plc/"
"""Prefix of the names of values that only the PLC has."""


class TagMapError(ConveyorError):
    """A map that can't be read, or does not fit the line or the PLC: file, line, the entry and what was expected."""


class MappedTag(NamedTuple):
    """One line of a map."""

    tag: Tag
    theirs: str
    where: str
    """File and line, for errors."""

    @property
    def is_written(self) -> bool:
        """True for signals and `run/tick`, which are written to the PLC."""
        name = self.tag.name
        return name == TICK or (self.tag.role in SIGNALS and not name.startswith(OWN))


class TagMap(NamedTuple):
    """Mapped tags by direction."""

    written: tuple[MappedTag, ...]
    """Signals, written to the PLC."""
    read: tuple[MappedTag, ...]
    """Commands and alarms, read from the PLC."""
    own: tuple[MappedTag, ...]
    """Other values of the PLC, read as well."""
    tick: MappedTag | None
    """`run/tick`, written after all signals; None if it is not in the map."""
    target: MappedTag | None
    """`run/target_tick`, which the PLC sets after its scan; None if it is not in the map."""

    @property
    def all(self) -> tuple[MappedTag, ...]:
        """All mapped tags."""
        handshake = (each for each in (self.tick, self.target) if each is not None)
        return (*self.written, *self.read, *self.own, *handshake)


def read_tag_map(path: Path, tags: Sequence[Tag]) -> TagMap:
    """Return the map in a file, for a line with these tags. Raise TagMapError."""
    try:
        text = read_file(path, MB).decode("utf-8-sig")
    except FileError as error:
        raise TagMapError(f"{path}: {error}, expected a CSV file of tags") from error
    except UnicodeDecodeError as error:
        raise TagMapError(f"{path}: is not UTF-8, expected a CSV file of tags") from error
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        rows = [(reader.line_num, cells) for cells in reader]
    except csv.Error as error:
        raise TagMapError(f"{path}: line {reader.line_num}: {error}, expected a CSV file of tags") from error
    columns = tuple(rows[0][1]) if rows else ()
    if columns not in (COLUMNS, (*COLUMNS, NOTE)):
        header = printable(",".join(rows[0][1])) if rows else "nothing"
        separated = " separated by commas, not semicolons" if ";" in header else ""
        raise TagMapError(f"{path}: line 1: {header} given, expected {','.join(COLUMNS)}{separated}")
    known = mappable(tags)
    mapped: dict[str, MappedTag] = {}
    for number, cells in rows[1:]:
        if not cells:
            continue
        where = f"{path}: line {number}"
        if len(cells) != len(columns) or not cells[1]:
            raise TagMapError(f"{where}: {printable(','.join(cells))} given, expected a tag and its place in the PLC")
        name, theirs = cells[0].strip(), cells[1]
        if not name and len(cells) > len(COLUMNS):
            continue
        tag = known.get(name) or _of_the_plc(name)
        if tag is None:
            expected = "expected a signal or command of the line, alarms/<name> or plc/<name>"
            if any(name == each.name and each.role == PANEL for each in tags):
                expected = f"an input of the panel that operators set, {expected}"
            raise TagMapError(f"{where}: {printable(name)} given, {expected} (conveyor-sim tags lists them)")
        if name in mapped:
            raise TagMapError(f"{where}: {printable(name)} given twice")
        mapped[name] = MappedTag(tag, theirs, where)
    if not mapped:
        raise TagMapError(f"{path}: has no tag, expected one or more")
    _require_apart(mapped.values())
    tick, target = mapped.pop(TICK, None), mapped.pop(TARGET, None)
    own = tuple(each for name, each in mapped.items() if name.startswith(OWN))
    written = tuple(each for each in mapped.values() if each.is_written)
    read = tuple(each for name, each in mapped.items() if not (each.is_written or name.startswith(OWN)))
    return TagMap(written, read, own, tick, target)


def mappable(tags: Sequence[Tag]) -> dict[str, Tag]:
    """Return the tags of a line that a map may name, and those of the handshake, by name."""
    return {tag.name: tag for tag in tags if tag.role in (*SIGNALS, *CONTROLLED)} | _HANDSHAKE


def _require_apart(mapped: Iterable[MappedTag]) -> None:
    """Raise TagMapError for a signal in the place of another signal or of a command, which it would overwrite."""
    taken: dict[str, MappedTag] = {}
    for each in mapped:
        if each.tag.name.startswith(OWN):
            continue
        other = taken.setdefault(each.theirs.strip(), each)
        if other is not each and (each.is_written or other.is_written):
            expected = f"expected a place that {printable(other.tag.name)} does not have"
            raise TagMapError(f"{each.where}: {printable(each.theirs)} given, {expected}")


def _of_the_plc(name: str) -> Tag | None:
    """Return the tag of an alarm or another value of the PLC; None for other names."""
    if name.startswith(ALARMS) and name != ALARMS:
        return switch(name, "command", "")
    return count(name, "status", "") if name.startswith(OWN) and name != OWN else None


_HANDSHAKE = {name: count(name, "run", "") for name in (TICK, TARGET)}

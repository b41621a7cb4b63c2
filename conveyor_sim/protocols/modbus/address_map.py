# SPDX-License-Identifier: Apache-2.0
"""Modbus addresses of a line: assigned from its tags, stored as CSV, and extended without moving a stored address."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag
from conveyor_sim.protocols.tags.control_mode import is_mode
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.support.files import FileError, write_file
from conveyor_sim.support.modbus_rows import (
    GONE,
    MOST_ADDRESSES,
    TABLES,
    WHOLE,
    Access,
    MapError,
    Row,
    Table,
    Type,
    WordOrder,
    read_map,
    to_csv,
)
from conveyor_sim.support.printable import printable

HANDSHAKE = MOST_ADDRESSES - 2
"""Address of the two tags of the handshake, after all others."""

SET_MODE = "/set_mode"
"""Suffix of the row that sets the control mode of a device; there is no tag of this name."""


def modbus_map(tags: Iterable[Tag], kept: Sequence[Row] = (), word_order: WordOrder = "big") -> list[Row]:
    """Return the map of a line: stored rows keep their addresses, and new tags follow them in their order.

    Signals are discrete inputs and input registers, commands are coils and holding registers. Faults are left out,
    because Modbus has no users. word_order: of new rows. A stored tag that the line no longer has keeps its address and
    is marked as gone. The two tags of the handshake always have the last addresses. Raises MapError for a tag whose
    type or table has changed, and if a table is full.
    """
    handshake = _handshake({row.name: row.word_order for row in kept}, word_order)
    kept = [row for row in kept if row.name not in (TICK, TARGET)]
    placed = {row.name: row for row in kept}
    for row in kept:
        if row.addresses.stop > HANDSHAKE and row.table in ("input register", "holding register"):
            raise MapError(f"{printable(row.name)}: address {row.address} given, expected one below {HANDSHAKE}")
    ends = {table: max((row.addresses.stop for row in kept if row.table == table), default=0) for table in TABLES}
    current: dict[str, Row] = {}
    known = [tag for tag in tags if tag.role in (*SIGNALS, *COMMANDS)]
    modes = [_mode_row(tag, word_order) for tag in known if is_mode(tag)]
    for new in [*(_row(tag, word_order) for tag in known), *modes]:
        if (old := placed.get(new.name)) is None:
            new = replace(new, address=ends[new.table])
            ends[new.table] += new.words
            if ends[new.table] > HANDSHAKE:
                raise MapError(f"{new.name}: no address left, expected at most {HANDSHAKE} in a table")
        elif (old.table, old.type) != (new.table, new.type):
            raise MapError(
                f"{new.name}: a {new.type} among the {new.table}s now, expected a {old.type} among the {old.table}s, "
                "as the map that was kept has it; a new map is needed"
            )
        else:
            new = replace(new, address=old.address, word_order=old.word_order)
        current[new.name] = new
    gone = {row.name: replace(row, description=GONE, access="read") for row in kept if row.name not in current}
    rows = [*current.values(), *gone.values(), *handshake]
    return sorted(rows, key=lambda row: (TABLES.index(row.table), row.address))


def _handshake(kept: Mapping[str, WordOrder], word_order: WordOrder) -> list[Row]:
    most = float(2**32 - 1)
    read, write = "The tick that all values are of.", "To which tick a line in lockstep is to go on, written last."
    return [
        Row(TICK, "input register", HANDSHAKE, "uint32", kept.get(TICK, word_order), "1", "read", 0.0, most, read),
        Row(
            TARGET,
            "holding register",
            HANDSHAKE,
            "uint32",
            kept.get(TARGET, word_order),
            "1",
            "read and write",
            0.0,
            most,
            write,
        ),
    ]


def _row(tag: Tag, word_order: WordOrder) -> Row:
    writes = tag.role in COMMANDS
    access: Access = "read and write" if writes else "read"
    if tag.kind == "bool":
        table: Table = "coil" if writes else "discrete input"
        kind: Type = "bool"
    else:
        table, kind = "holding register" if writes else "input register", _type(tag)
    least, most = WHOLE.get(kind, (-math.inf, math.inf))
    low, high = max(tag.low, float(least)), min(tag.high, float(most))
    return Row(tag.name, table, 0, kind, word_order, tag.unit, access, low, high, _described(tag, tag.description))


def _described(tag: Tag, description: str) -> str:
    """Return a description with the texts of an enumeration, because Modbus names no values."""
    return f"{description} {tag.listed_texts}." if tag.texts else description


def _mode_row(tag: Tag, word_order: WordOrder) -> Row:
    name, what = f"{tag.device}{SET_MODE}", _described(tag, "Puts it into a mode; reads as the present one.")
    return Row(name, "holding register", 0, "uint16", word_order, tag.unit, "read and write", tag.low, tag.high, what)


def _type(tag: Tag) -> Type:
    if tag.kind == "number":
        return "float64" if tag.unit == "s" else "float32"  # days with a resolution of microseconds
    if tag.kind == "enumeration":
        return "uint16"
    return "int32" if tag.low < 0.0 else "uint32"


def keep_map(path: Path, tags: Iterable[Tag], word_order: WordOrder = "big") -> list[Row]:
    """Return the map in a file, extended by new tags of the line. Write the file if it changes or is new.

    Raises MapError, which leaves the file as it was.
    """
    kept = read_map(path) if path.exists() else []
    rows = modbus_map(tags, kept, word_order)
    if rows != kept:
        try:
            write_file(path, to_csv(rows).encode())
        except FileError as error:
            raise MapError(f"{path}: {error}, expected a file for the Modbus map") from error
    return rows

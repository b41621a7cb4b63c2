# SPDX-License-Identifier: Apache-2.0
"""Modbus map: table, address and type of each tag, with the CSV file that stores it and the encoding of values.

Modbus has four tables, of bits and of 16-bit words, and neither names nor types nor units: a client is configured
from this map. Addresses are protocol addresses, from 0; the register that manuals call 40001 is holding register 0.
(Modbus Application Protocol 1.1b3, 4.3 and 4.4.)
"""

from __future__ import annotations

import csv
import io
import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable
from conveyor_sim.support.rounded_limit import at_limit, single

Table = Literal["coil", "discrete input", "input register", "holding register"]
"""A client may write coils and holding registers."""

Type = Literal["bool", "uint16", "uint32", "int32", "float32", "float64"]

WordOrder = Literal["big", "little"]
"""Order of the words of a value. big: the highest word first (ABCD); little: the lowest first (CDAB). Within a word the
high byte always comes first.
"""

Access = Literal["read", "read and write"]

WORDS: dict[Type, int] = {"bool": 1, "uint16": 1, "uint32": 2, "int32": 2, "float32": 2, "float64": 4}
"""Addresses that a value takes."""

MOST_ADDRESSES = 65536
"""In each table."""

GONE = "gone"
"""Description of a tag that the line no longer has. No other tag gets its address."""

_MOST_BYTES = 16 * MB
TABLES: tuple[Table, ...] = get_args(Table)
_FORMATS: dict[Type, str] = {"uint16": ">H", "uint32": ">I", "int32": ">i", "float32": ">f", "float64": ">d"}


class MapError(ConveyorError):
    """A Modbus map that can't be read, or that does not fit a line: file, line, field, value and what was expected."""


WHOLE: dict[Type, tuple[int, int]] = {
    "uint16": (0, 2**16 - 1),
    "uint32": (0, 2**32 - 1),
    "int32": (-(2**31), 2**31 - 1),
}
"""Ranges of the integer types."""
_MOST_FLOAT32 = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Row:
    """Address of one tag: a line of the CSV file, in the order of its columns."""

    name: str
    """Name of the tag."""
    table: Table
    address: int
    """Address of its first word or bit, from 0."""
    type: Type
    word_order: WordOrder
    unit: str
    """Unit of the tag; values are not scaled."""
    access: Access
    low: float
    """Range of the tag, within the range of the type."""
    high: float
    description: str
    """Description of the tag, with the texts of an enumeration."""

    @property
    def words(self) -> int:
        """Number of its addresses."""
        return WORDS[self.type]

    @property
    def addresses(self) -> range:
        """Its addresses in its table."""
        return range(self.address, self.address + self.words)


_COLUMNS = tuple(field.name for field in fields(Row))


def encode(row: Row, value: float) -> list[int]:
    """Return a value as the words of a row, or as one bit, clipped to the range of the type.

    NaN and infinity as an integer are 0.
    """
    if row.type == "bool":
        return [int(value != 0.0)]
    if limits := WHOLE.get(row.type):
        value = min(limits[1], max(limits[0], int(value))) if math.isfinite(value) else 0
    elif row.type == "float32" and math.isfinite(value):
        value = max(-_MOST_FLOAT32, min(_MOST_FLOAT32, value))
    packed = struct.pack(_FORMATS[row.type], value)
    words = [int.from_bytes(packed[at : at + 2], "big") for at in range(0, len(packed), 2)]
    return words if row.word_order == "big" else words[::-1]


def decode(row: Row, words: Sequence[int]) -> float:
    """Return the value of a row's words, (words,), each 0 to 65535, or of its bit.

    A float32 is read as the shortest decimal number of its bits: 0.1, not 0.10000000149. A limit of the row that was
    rounded to 32 bits is read as that limit.
    """
    if row.type == "bool":
        return float(bool(words[0]))
    ordered = words if row.word_order == "big" else list(words)[::-1]
    packed = b"".join(int(word).to_bytes(2, "big") for word in ordered)
    (value,) = struct.unpack(_FORMATS[row.type], packed)
    return at_limit(_shortest(value), row.low, row.high, _shortest) if row.type == "float32" else float(value)


def _shortest(value: float) -> float:
    """Return the shortest number that rounds to the same 32 bits."""
    return float(str(np.float32(single(value))))


def to_csv(rows: Iterable[Row]) -> str:
    """Return the map as text in CSV."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for row in rows:
        writer.writerow([_shown(getattr(row, column)) for column in _COLUMNS])
    return out.getvalue()


def _shown(value: str | int | float) -> str:
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def read_map(path: Path) -> list[Row]:
    """Return the map in a file. Raises MapError."""
    try:
        text = read_file(path, _MOST_BYTES).decode("utf-8-sig")
    except FileError as error:
        raise MapError(f"{path}: {error}, expected a Modbus map") from error
    except UnicodeDecodeError as error:
        raise MapError(f"{path}: is not UTF-8, expected a Modbus map") from error
    try:
        return _rows(str(path), csv.reader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise MapError(f"{path}: {error}, expected a Modbus map, as CSV") from error


def _rows(path: str, reader: Iterable[list[str]]) -> list[Row]:
    rows: list[Row] = []
    names: set[str] = set()
    taken: dict[tuple[Table, int], str] = {}
    for line, cells in enumerate(reader, start=1):
        if line == 1:
            if tuple(cells) != _COLUMNS:
                raise MapError(f"{path}: line 1: {_quoted(cells)} given, expected {','.join(_COLUMNS)}")
            continue
        row = _parsed(f"{path}: line {line}", cells)
        if row.name in names:
            raise MapError(f"{path}: line {line}: name {printable(row.name)} given twice")
        names.add(row.name)
        for address in row.addresses:
            if other := taken.get((row.table, address)):
                raise MapError(
                    f"{path}: line {line}: address {row.address} given, expected another: {printable(other)} has "
                    f"{row.table} {address}"
                )
            taken[row.table, address] = row.name
        rows.append(row)
    if not names:
        raise MapError(f"{path}: holds no tag, expected a Modbus map")
    return rows


def _parsed(where: str, cells: list[str]) -> Row:
    if len(cells) != len(_COLUMNS):
        raise MapError(f"{where}: {len(cells)} columns given, expected {len(_COLUMNS)}: {', '.join(_COLUMNS)}")
    values = dict(zip(_COLUMNS, cells, strict=True))
    for column, allowed in _CHOICES.items():
        if values[column] not in allowed:
            raise MapError(f"{where}: {column} {printable(values[column])} given, expected one of {', '.join(allowed)}")
    numbers: dict[str, float] = {}
    for column in ("low", "high"):
        try:
            numbers[column] = float(values[column])
        except ValueError:
            raise MapError(f"{where}: {column} {printable(values[column])} given, expected a number") from None
    kind: Type = values["type"]  # type: ignore[assignment]
    most = MOST_ADDRESSES - WORDS[kind]
    address = values["address"]
    if not (address.isascii() and address.isdigit() and len(address) <= 5 and int(address) <= most):
        raise MapError(f"{where}: address {printable(address)} given, expected a whole number from 0 to {most}")
    bits = values["table"] in ("coil", "discrete input")
    if bits != (kind == "bool"):
        expected = "bool" if bits else f"one of {', '.join(_FORMATS)}"
        raise MapError(f"{where}: type {kind} given, expected {expected}: a {values['table']}")
    if not values["name"]:
        raise MapError(f"{where}: name is empty, expected that of a tag")
    return Row(**{**values, "address": int(address), **numbers})  # type: ignore[arg-type]


_CHOICES: dict[str, tuple[str, ...]] = {
    "table": TABLES,
    "type": get_args(Type),
    "word_order": get_args(WordOrder),
    "access": get_args(Access),
}


def _quoted(cells: list[str]) -> str:
    return printable(",".join(cells)) or "an empty line"

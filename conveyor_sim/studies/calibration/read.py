# SPDX-License-Identifier: Apache-2.0
"""Measurements in a CSV file: one per row, with units in the headers."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.errors import CalibrationError
from conveyor_sim.scene.contacts import Base
from conveyor_sim.scene.part import part_from
from conveyor_sim.scene.quantities import to_si
from conveyor_sim.scene.words import cut, did_you_mean, listed
from conveyor_sim.studies.calibration.quantities import COLUMNS, KINDS, OPTIONAL_TEXTS, TEXT_COLUMNS
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable

_MOST_BYTES = 10 * MB
_MOST_ROWS = 100_000
_MOST_SAID = 20
"""Largest number of problems that an error lists."""
_ROUNDING = 1e-12
"""Relative error of a conversion: 180 deg may be a bit more than pi."""
_HEADER = re.compile(r"\s*([^()\[\]]*?)\s*(?:[(\[]\s*(.*?)\s*[)\]])?\s*")
"""Name of a column and the unit in brackets."""
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")
_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]*,[0-9]+([eE][-+]?[0-9]{1,3})?")
_BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


@dataclass(frozen=True)
class Measurement:
    """A row of the file."""

    line: int
    kind: str
    """Name in `KINDS`."""
    between: tuple[str, str]
    """Material of the bottle, "" without one, then the other material."""
    sample: str
    """Sample that the row belongs to; "" if the file names none."""
    values: Mapping[str, float]
    """SI values by column."""


@dataclass(frozen=True)
class _Header:
    """A column of a file."""

    name: str
    unit: str = ""
    factor: float = 1.0
    """SI value of one unit."""


def read_measurements(path: Path) -> list[Measurement]:
    """Return the measurements in a CSV file.

    The separator is a semicolon, a tab or a comma. Numbers have a decimal point, or, unless commas separate, a comma.
    The text is UTF-8, or UTF-16 with a byte-order mark. Raise CalibrationError with one line per problem.
    """
    try:
        content = read_file(path, _MOST_BYTES)
    except FileError as error:
        raise CalibrationError(f"{path}: {error}, expected a CSV file of measurements") from error
    return _Table(str(path), _decoded(path, content)).measurements()


def _decoded(path: Path, content: bytes) -> str:
    encoding = _BYTE_ORDER_MARKS.get(content[:2], "utf-8-sig")
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise CalibrationError(
            f"{path}:{line}: is not {encoding.removesuffix('-sig').upper()}, expected a CSV file in UTF-8 "
            "(in Excel: Save As, CSV UTF-8)"
        ) from None
    if "\0" in text:
        raise CalibrationError(f"{path}: has null characters, expected a CSV file of measurements")
    return text


class _Table:
    """Rows of a file and the problems found in them."""

    def __init__(self, path: str, text: str) -> None:
        """Split a text into rows. Raise CalibrationError for text that is no CSV."""
        self.path = path
        self._problems: list[str] = []
        # Comments may have single quotes, in which a reader of CSV would look for the second one.
        lines = ["" if line.lstrip(' "').startswith("#") else line for line in re.split(r"\r\n|\r|\n", text)]
        first = next((line for line in lines if line.strip(" ,;\t")), None)
        if first is None:
            raise CalibrationError(f"{path}: has no rows, expected a header with the columns {_first_columns()}")
        self.separator = next((mark for mark in ";\t" if mark in first), ",")
        self._rows = self._split(lines)
        self._line, header = next(self._rows)
        self._headers = self._columns(header)
        self._decimal_mark = ""
        """Decimal mark of the first number that has one. The other one is refused: it may separate thousands."""

    def _split(self, lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of each row that is not empty."""
        rows = csv.reader(lines, delimiter=self.separator, strict=True)
        while True:
            begin = rows.line_num + 1
            try:
                row = next(rows, None)
            except csv.Error as error:
                raise CalibrationError(
                    f"{self.path}:{begin}: can't be read ({error}), expected a row of a CSV file"
                ) from None
            if row is None:
                return
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield begin, cells

    def measurements(self) -> list[Measurement]:
        """Return all rows. Raise CalibrationError with all problems."""
        read: list[Measurement] = []
        if not self._problems:
            for line, cells in self._rows:
                self._line = line
                if len(read) == _MOST_ROWS:
                    self._problem("", f"expected at most {_MOST_ROWS} rows")
                    break
                if (measurement := self._row(cells)) is not None:
                    read.append(measurement)
            if not read and not self._problems:
                self._problem("", "no measurement below the header, expected one or more rows")
        if self._problems:
            more = len(self._problems) - _MOST_SAID
            rest = [f"{self.path}: {more} more problems"] if more > 0 else []
            raise CalibrationError("\n".join([*self._problems[:_MOST_SAID], *rest]))
        return read

    def _problem(self, column: str, text: str) -> None:
        where = f"{column}: " if column else ""
        self._problems.append(f"{self.path}:{self._line}: {where}{text}")

    def _columns(self, cells: Sequence[str]) -> list[_Header]:
        """Return the columns by the cells of the header, "" for empty ones."""
        if not any(_name(cell) in {*TEXT_COLUMNS, *COLUMNS} for cell in cells):
            self._problem("", f"no header given, expected one with the columns {_first_columns()}")
            return []
        headers = [self._column(cell) for cell in cells]
        names = [header.name for header in headers if header.name]
        for name in dict.fromkeys(name for name in names if names.count(name) > 1):
            self._problem(name, "given twice, expected each column once")
        if not self._problems:
            for name in TEXT_COLUMNS:
                if name not in names and name not in OPTIONAL_TEXTS:
                    self._problem(name, f"no such column, expected the columns {_first_columns()}")
        return headers

    def _column(self, cell: str) -> _Header:
        match = _HEADER.fullmatch(cell)
        name, unit = _name(cell), match[2] if match else None
        if name in TEXT_COLUMNS or not cell:
            if unit is not None:
                self._problem(name, f"unit {_quoted(unit)} given, expected none: the column has texts")
            return _Header(name)
        if name not in COLUMNS:
            self._problem(_shown(name), f"no such column, {did_you_mean(name, [*TEXT_COLUMNS, *COLUMNS])}")
            return _Header(name)
        column = COLUMNS[name]
        example = f"expected such as {name} ({column.usual})"
        if not unit:
            self._problem(name, f"no unit given, {example}")
            return _Header(name)
        try:
            factor = float(to_si(f"1 {unit}", column.unit))
        except ValueError as error:
            reason = str(error).partition("; found ")[2]
            self._problem(name, f"unit {_quoted(unit)} given, {example}; found {printable(reason, 60)}")
            return _Header(name)
        if not factor > 0.0:
            self._problem(name, f"unit {_quoted(unit)} given, {example}")
        return _Header(name, unit, factor)

    def _row(self, cells: Sequence[str]) -> Measurement | None:
        """Return a measurement; None after a problem."""
        before = len(self._problems)
        if len(cells) > len(self._headers) and any(cells[len(self._headers) :]):
            hint = "; decimal commas need semicolons between the columns" if self.separator == "," else ""
            self._problem("", f"{len(cells)} cells given, expected {len(self._headers)}, one per column{hint}")
            return None
        by_column = list(zip(self._headers, [*cells, *[""] * len(self._headers)], strict=False))
        texts = {header.name: cell for header, cell in by_column if header.name in TEXT_COLUMNS}
        for header, cell in by_column:
            if not header.name and cell:
                self._problem("", f"{_quoted(cell)} given in a column without a name, expected none")
        kind = KINDS.get(texts["quantity"])
        if kind is None:
            given = _quoted(texts["quantity"]) + " given" if texts["quantity"] else "missing"
            self._problem("quantity", f"{given}, {did_you_mean(texts['quantity'], list(KINDS))}")
            return None
        between = texts["material"], texts["other"]
        if between[0] and not kind.has_bottle:
            self._problem("material", f"{_quoted(between[0])} given, expected none: {texts['quantity']} has no bottle")
        for name, text in zip(("material", "other"), between, strict=True):
            if (kind.has_bottle or name == "other") and isinstance(
                part_from(Base, {"between": [text, "other"], "friction": 0.0}), str
            ):
                given = f"{_quoted(text)} given" if text else "missing"
                self._problem(name, f"{given}, expected a name of letters, digits and underscores, as in a scene")
        values = {}
        for header, cell in by_column:
            if header.name not in COLUMNS:
                continue
            if header.name in kind.columns:
                if (number := self._number(header, cell)) is not None:
                    values[header.name] = number
            elif cell:
                needed = listed(list(kind.columns))
                self._problem(header.name, f"{_quoted(cell)} given, expected none: {texts['quantity']} has {needed}")
        absent = [name for name in kind.columns if all(header.name != name for header in self._headers)]
        if absent:
            needed = ", ".join(f"{name} ({COLUMNS[name].usual})" for name in absent)
            self._problem(texts["quantity"], f"needs columns that the header doesn't have, expected {needed}")
        if len(self._problems) > before:
            return None
        return Measurement(self._line, texts["quantity"], between, texts.get("sample", ""), values)

    def _number(self, header: _Header, cell: str) -> float | None:
        """Return the SI value of a cell; None after a problem."""
        column = COLUMNS[header.name]
        expected = f"expected {_range(header)}"
        text = cell.replace("\u2212", "-")
        mark = "," if self.separator != "," and _DECIMAL_COMMA.fullmatch(text) else "." if "." in text else ""
        if mark == ",":
            text = text.replace(",", ".")
        if mark and _NUMBER.fullmatch(text):
            self._decimal_mark = self._decimal_mark or mark
            if mark != self._decimal_mark:
                other = "comma" if mark == "." else "point"
                self._problem(header.name, f"{_quoted(cell)} given, expected a decimal {other}, as in rows above")
                return None
        if not _NUMBER.fullmatch(text):
            given = f"{_quoted(cell)} given" if cell else "missing"
            hint = ""
            if "," in text and self.separator == ",":
                hint = "; decimal commas need semicolons between the columns"
            elif any(letter.isalpha() for letter in cell):
                hint = "; the unit belongs in the header"
            self._problem(header.name, f"{given}, {expected}{hint}")
            return None
        value = float(text) * header.factor
        low, high = column.low - _ROUNDING * abs(column.low), column.high + _ROUNDING * abs(column.high)
        if not low <= value <= high:
            self._problem(header.name, f"{_shown(cell)} {header.unit} given, {expected}")
            return None
        return value


def _name(cell: str) -> str:
    """Return the name of a column from its header."""
    match = _HEADER.fullmatch(cell)
    return match[1].lower().replace(" ", "_") if match else cell


def _first_columns() -> str:
    return ", ".join(name for name in TEXT_COLUMNS if name not in OPTIONAL_TEXTS) + " and those of the measurements"


def _range(header: _Header) -> str:
    """Return the expectation of a number, in the unit of the header."""
    column = COLUMNS[header.name]
    low, high = (f"{limit / header.factor:g}" for limit in (column.low, column.high))
    return f"a number from {low} to {high} ({header.unit})"


def _quoted(text: str) -> str:
    return f'"{_shown(text)}"'


def _shown(text: str) -> str:
    return cut(printable(text))

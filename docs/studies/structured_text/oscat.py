# SPDX-License-Identifier: Apache-2.0
"""OSCAT functions with values from closed forms, which do not come from any compiler: oscat_values.csv.

A row has a call, and its value as an expression of Python: `expected` uses the names of `math`, those of `cmath` with a
`c` before them, and `date`. Times and dates are in ns. An empty tolerance means equality.
"""

from __future__ import annotations

import cmath
import csv
import datetime
import math
import re
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Any

from units import Check, Part, Unit, files, reached

LIBRARY = "Codesys Lib And Manual/oscat_basic_333.lib"
"""Binary library of the same checkout."""

TABLE = Path(__file__).with_name("oscat_values.csv")


def valued(folder: Path) -> Iterator[Unit]:
    """Yield one unit for each row: a program that calls the function, with the objects that it needs."""
    parts = [*files(folder, (".exp",)), global_lists(folder)]
    with TABLE.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        declared = f"{row['declare']}\nresult : {row['type']};"
        text = f"PROGRAM main\nVAR\n{declared}\nEND_VAR\nresult := {row['call']};\nEND_PROGRAM\n"
        own = Part(f"values of {row['function']}", text)
        yield Unit(row["function"], reached([own], parts), tuple(_checks(row)))


def global_lists(folder: Path) -> Part:
    """Return the lists of global variables, which are not exported. The binary library contains their text."""
    text = (folder / LIBRARY).read_bytes().decode("latin-1")
    return Part(PurePath(LIBRARY).name, "\n".join(re.findall(r"VAR_GLOBAL\b[\t\r\n -~]*?END_VAR", text)))


def _checks(row: dict[str, str]) -> Iterator[Check]:
    """Yield the checks of a row; a complex number has two."""
    value, tolerance = eval(row["expected"], dict(_NAMES)), float(row["tolerance"] or 0.0)
    if isinstance(value, complex):
        yield Check("main/result/re", value.real, tolerance)
        yield Check("main/result/im", value.imag, tolerance)
    else:
        yield Check("main/result", value, tolerance)


def _date(year: int, month: int, day: int) -> int:
    """Return a day as ns since 1970."""
    return (datetime.date(year, month, day) - datetime.date(1970, 1, 1)).days * 86_400 * 10**9


_NAMES: dict[str, Any] = {
    **{f"c{name}": value for name, value in vars(cmath).items() if not name.startswith("_")},
    **{name: value for name, value in vars(math).items() if not name.startswith("_")},
    "phase": cmath.phase,
    "rect": cmath.rect,
    "date": _date,
}

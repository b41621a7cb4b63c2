# SPDX-License-Identifier: Apache-2.0
"""Study of public PLC code: compiles every unit, compares values, and renews docs/studies/structured_text.md.

    python docs/studies/structured_text/run.py FOLDER               # all sources
    python docs/studies/structured_text/run.py FOLDER oscat scl     # some of them; prints and writes nothing
    python docs/studies/structured_text/run.py                      # only the page, from the stored results

FOLDER contains checkouts at the commits that the page lists, each with the name of its repository. A unit counts as
right if it compiles together with everything that it needs, and gives the expected values where there are any. A unit
that needs a library without source counts as refused.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import page
from sources import SOURCES, Source
from units import Check, Unit

from conveyor_sim.control.st.compile import compile_texts
from conveyor_sim.control.st.dialect import DIALECTS
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.program import Program
from conveyor_sim.control.st.program_files import Text
from conveyor_sim.control.st.types import Moment
from conveyor_sim.support.rounded_limit import single

ROOT = Path(__file__).resolve().parents[3]
TABLE = ROOT / "docs" / "studies" / "structured_text.csv"
_MAIN = Text("study_main.st", "PROGRAM study_main ; END_PROGRAM")


@dataclass(frozen=True)
class Row:
    """Result of a unit."""

    source: str
    unit: str
    group: str
    """`points`, `needs pointers` or ""."""
    result: str
    """right, refused or different."""
    message: str


def judged(source: Source, unit: Unit) -> Row:
    """Compile a unit, run it if values are expected, and return the result."""
    texts = [Text(part.name, part.text) for part in unit.parts]
    try:
        program = _program(texts, source.dialect)
        for time in unit.times if unit.checks else ():
            program.run(time)
        wrong = next((words for check in unit.checks if (words := _difference(program, check, unit))), "")
    except StructuredTextError as error:
        return Row(source.key, unit.name, unit.group, "refused", str(error))
    return Row(source.key, unit.name, unit.group, "different" if wrong else "right", wrong)


def _program(texts: Sequence[Text], dialect: str) -> Program:
    try:
        return Program(compile_texts(texts, False, DIALECTS[dialect]), 100_000_000)
    except StructuredTextError as error:
        if "found no PROGRAM" not in str(error):
            raise
    return Program(compile_texts([*texts, _MAIN], False, DIALECTS[dialect]))


def _difference(program: Program, check: Check, unit: Unit) -> str:
    """Return the difference from an expected value, in words; "" for the value itself."""
    name = check.variable if isinstance(check.variable, str) else _name(program, check, unit)
    if (variable := program.variables.get(name)) is None:
        return f"{name}: no such variable"
    found, value, kind = variable.read(), check.value, variable.type.base
    if isinstance(kind, Moment) and unit.unit != 1:
        value *= kind.unit
    elif kind.kind == "time":
        value *= unit.unit
    if kind.name == "REAL":
        value = single(value)
    if isinstance(found, int) and isinstance(value, int) and found - value in (2**32, 2**64):
        return ""  # the test reads an unsigned number as a signed one
    near = check.tolerance or (1e-6 * abs(value) if isinstance(found, float) else 0.0)
    same = found == value or (math.isnan(found) and math.isnan(value)) or abs(found - value) <= near
    return "" if same else f"{name}: found {found}, expected {value}"


def _name(program: Program, check: Check, unit: Unit) -> str:
    """Return the name of a variable, by a name that only one variable has, or by its number from the end.

    Numbers of ironplc count global variables and those of the program, after a few that it adds.
    """
    named = [name for name in program.variables if name == check.name or name.endswith(f"/{check.name}")]
    if check.name and len(named) == 1:
        return named[0]
    main = program.compiled.programs[0]
    inside = [
        key for key, member in main.type.members.items() if member.section != "VAR_EXTERNAL" and not member.address
    ]
    names = [f"{main.name.lower()}/{key}" for key in inside]
    if not check.name:
        names = [*program.compiled.globals.members, *names]
    last = max(one.variable for one in unit.checks if isinstance(one.variable, int))
    index = int(check.variable) - max(unit.before, last + 1 - len(names))
    return names[index] if 0 <= index < len(names) else f"variable {check.variable}"


def rows(folder: Path, chosen: Sequence[str]) -> Iterator[Row]:
    """Yield the results of all units of the chosen sources whose checkouts are there."""
    for source in SOURCES:
        if not chosen or source.key in chosen:
            if not (folder / source.folder).is_dir():
                sys.exit(f"{folder / source.folder}: no such folder, expected a checkout of {source.repository}")
            for unit in source.units(folder / source.folder):
                yield judged(source, unit)


def main() -> None:
    """Run the study, or with some sources print their results."""
    if len(sys.argv) > 1:
        results = list(rows(Path(sys.argv[1]), sys.argv[2:]))
        if sys.argv[2:]:
            print(page.summary(results))
            print("\n".join(f"{row.result}\t{row.unit}\t{row.message}" for row in results if row.result != "right"))
            return
        with TABLE.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(("source", "unit", "group", "result", "message"))
            writer.writerows((row.source, row.unit, row.group, row.result, row.message) for row in results)
    with TABLE.open(newline="", encoding="utf-8") as file:
        stored = [Row(**row) for row in csv.DictReader(file)]
    page.write(ROOT / "docs" / "studies" / "structured_text.md", stored)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: Apache-2.0
"""Stored runs of the validation: one CSV file per source in docs/validation/."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import write_file
from validation.source import Case, Run, Source

FOLDER = Path(__file__).resolve().parents[2] / "validation"

CPU = "cpu_s"
"""Column of the processor time of a run, s, without compiling kernels."""


def table(source: Source) -> Path:
    """Return the CSV file of a source."""
    return FOLDER / f"{source.name}.csv"


def picture(source: Source) -> Path:
    """Return the picture of a source."""
    return FOLDER / f"{source.name}.svg"


def key(source: Source, run: Case) -> tuple[str, ...]:
    """Return the parameters of a run as text, which identify it within its source."""
    return tuple(_text(run[name]) for name in source.cases()[0])


def read(source: Source) -> list[Run]:
    """Return the stored runs of a source that its present cases include, in their order.

    Raise ConveyorError if the file has no column for a parameter of the cases, or a row of another length.
    """
    if not table(source).exists():
        return []
    with table(source).open(newline="", encoding="utf-8") as file:
        lines = csv.DictReader(file)
        rows = []
        for line in lines:
            wanted = {*source.cases()[0], CPU}
            if None in line or None in line.values() or not wanted <= set(line):
                names = ", ".join(source.cases()[0])
                raise ConveyorError(f"{table(source)}, line {lines.line_num}: expected columns {names}, results, {CPU}")
            rows.append({name: _value(text) for name, text in line.items()})
    stored = {key(source, row): row for row in rows}
    return [stored[name] for name in (key(source, case) for case in source.cases()) if name in stored]


def write(source: Source, runs: Sequence[Run]) -> None:
    """Write the runs of a source in the order of its cases. Values have six significant digits."""
    FOLDER.mkdir(exist_ok=True)
    order = {key(source, case): number for number, case in enumerate(source.cases())}
    text = io.StringIO()
    writer = csv.DictWriter(text, list(runs[0]), lineterminator="\n")
    writer.writeheader()
    for run in sorted(runs, key=lambda run: order[key(source, run)]):
        writer.writerow({name: _text(value) for name, value in run.items()})
    write_file(table(source), text.getvalue().encode())


def _text(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def _value(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text

"""The table of a study, a row a run, with units, and what it is of."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from conveyor_sim.errors import StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.studies.journal import ASKED, ORIGIN, SOURCE, UNITS, VERSION, WARM_UP, read_rows
from conveyor_sim.studies.row import Row
from conveyor_sim.studies.study import HALF_WIDTH, Seeds, Until
from conveyor_sim.support.files import FileError, write_file
from conveyor_sim.version import __version__

PARQUET = "results.parquet"
METADATA = "conveyor_sim"
"""Key of what the file says of itself."""
FIXED_UNITS = {"simulated": "s", "dt": "s", "wall": "s", "cpu": "s"}
MOST = 64_000_000
"""Bytes of a file of units or of a study that are read."""


@dataclass(frozen=True)
class Results:
    """The runs of a study."""

    study: str
    """Text of its file."""
    path: str
    """Of its file, as the study was run."""
    units: Mapping[str, str]
    """By metric."""
    parameters: Mapping[str, str]
    """Their units, "" where it is not known, or there is none."""
    versions: Mapping[str, str]
    rows: Sequence[Row]
    warm_up: float | None = None
    """s, where pilot runs have found it; None: as the study says."""

    @property
    def name(self) -> str:
        """Of the study."""
        return str(parse_overrides(self.study).get("name", ""))

    @property
    def until(self) -> Until | None:
        """When a point has been run often enough; None: the number of seeds is given."""
        seeds = parse_overrides(self.study).get("seeds")
        return Seeds.model_validate(seeds).until if isinstance(seeds, dict) else None

    def unit(self, metric: str) -> str:
        """As it stands behind a number: "" for what has no dimension."""
        return "" if self.units[metric] == "1" else self.units[metric]

    def command(self, row: Row) -> str:
        """What makes a run again, alone."""
        return run_command(self.path, row, self.warm_up)

    @property
    def one_run_each(self) -> bool:
        """Whether no point has been run with two seeds."""
        return len({row.point for row in self.rows}) == len(self.rows)


def run_command(path: str, row: Row, warm_up: float | None = None) -> str:
    """What makes a run of a study file again, alone. warm_up: s, if pilot runs have found it."""
    given = [f"--set {name}={shlex.quote(text_of(value))}" for name, value in row.parameters.items()]
    found = [] if warm_up is None else [f"--warm-up {warm_up!r}"]
    return " ".join(["conveyor-sim sweep", shlex.quote(path), *given, f"--seed {row.seed}", *found])


def text_of(value: Any) -> str:
    """A value of a parameter, as YAML reads it."""
    return json.dumps(value)


def read_results(path: Path) -> Results:
    """Of the folder of a study, finished or not, or of its Parquet file alone. Raises StudyError."""
    if path.is_file():
        return _of_parquet(path)
    rows = read_rows(path)
    try:
        study = (path / SOURCE).read_text(encoding="utf-8")
        about = json.loads((path / UNITS).read_text(encoding="utf-8"))
        origin = json.loads((path / ORIGIN).read_text(encoding="utf-8"))
        versions = {"conveyor_sim": __version__, "engine": origin["engine"], "sources": origin[VERSION]}
        units, parameters, found = about["units"], about["parameters"], origin.get(WARM_UP)
        rows = [_as_asked(row, about[ASKED]) for row in rows]
        return Results(study, about["path"], units, parameters, versions, rows, found)
    except (OSError, ValueError, KeyError, TypeError):
        raise StudyError(
            f"{path}: not the folder of a study that has begun, expected one of conveyor-sim sweep"
        ) from None


def _as_asked(row: Row, asked: Mapping[str, str]) -> Row:
    """With the metrics of today; NaN: the run was made before it was asked for this one."""
    if row.status != "finished":
        return row
    known = {name for name, what in asked.items() if row.asked.get(name) == what}
    metrics = {name: row.metrics[name] if name in known else math.nan for name in asked}
    halves = {name: half for name, half in row.half_widths.items() if name in known}
    return replace(row, metrics=metrics, half_widths=halves)


def write_parquet(results: Results, path: Path) -> Path:
    """One file, readable by itself. Raises StudyError if it can't be written or pyarrow is missing."""
    if find_spec("pyarrow") is None:
        raise StudyError("a Parquet file: pyarrow is not installed, expected it (pip install 'conveyor_sim[studies]')")
    import pyarrow
    from pyarrow import parquet

    table = _table(results)
    sink = pyarrow.BufferOutputStream()
    parquet.write_table(table, sink)
    try:
        write_file(path, sink.getvalue().to_pybytes())
    except FileError as error:
        raise StudyError(f"{path}: {error}, expected a file to write to; all runs are kept in {path.parent}") from None
    return path


def _table(results: Results) -> Any:
    import pyarrow

    rows = results.rows
    columns: dict[str, tuple[Any, str]] = {
        "point": (pyarrow.array([row.point for row in rows], pyarrow.int64()), ""),
        "seed": (pyarrow.array([row.seed for row in rows], pyarrow.uint64()), ""),
    }
    for name, unit in results.parameters.items():
        columns[name] = (pyarrow.array(_alike([row.parameters.get(name) for row in rows])), unit)
    for name, unit in results.units.items():
        values = [row.metrics.get(name) for row in rows]
        columns[name] = (pyarrow.array(values, pyarrow.float64()), unit)
        if any(name in row.half_widths for row in rows):
            halves = [row.half_widths.get(name) for row in rows]
            columns[name + HALF_WIDTH] = (pyarrow.array(halves, pyarrow.float64()), unit)
    for name in ("status", "error"):
        columns[name] = (pyarrow.array([getattr(row, name) for row in rows], pyarrow.string()), "")
    for name, unit in FIXED_UNITS.items():
        columns[name] = (pyarrow.array([getattr(row, name) for row in rows], pyarrow.float64()), unit)
    for name, texts in {
        "bag": [row.bag for row in rows],
        "command": [results.command(row) for row in rows],
        "versions": [" ".join(f"{what}={value}" for what, value in results.versions.items())] * len(rows),
    }.items():
        columns[name] = (pyarrow.array(texts, pyarrow.string()), "")
    fields = [
        pyarrow.field(name, column.type, metadata={"unit": unit} if unit else None)
        for name, (column, unit) in columns.items()
    ]
    about = {
        "study": results.study,
        "path": results.path,
        "units": dict(results.units),
        "parameters": dict(results.parameters),
        "versions": dict(results.versions),
        WARM_UP: results.warm_up,
    }
    schema = pyarrow.schema(fields, metadata={METADATA: json.dumps(about)})
    return pyarrow.Table.from_arrays([column for column, _ in columns.values()], schema=schema)


def _of_parquet(path: Path) -> Results:
    if find_spec("pyarrow") is None:
        raise StudyError(f"{path}: pyarrow is not installed, expected it (pip install 'conveyor_sim[studies]')")
    from pyarrow import ArrowException, parquet

    try:
        table = parquet.read_table(path)
        about = json.loads(table.schema.metadata[METADATA.encode()])
        rows = [_row(values, about) for values in table.to_pylist()]
        kept = {name: about[name] for name in ("study", "path", "units", "parameters", "versions")}
        return Results(**kept, rows=rows, warm_up=about.get(WARM_UP))
    except (ArrowException, KeyError, TypeError, ValueError, OSError):
        raise StudyError(f"{path}: not the results of a study, expected a Parquet file of conveyor-sim sweep") from None


def _row(values: Mapping[str, Any], about: Mapping[str, Any]) -> Row:
    kept = ("point", "seed", "status", "error", *FIXED_UNITS, "bag")
    finished = values["status"] == "finished"
    halves = {name: values[name + HALF_WIDTH] for name in about["units"] if name + HALF_WIDTH in values}
    return Row(
        **{name: values[name] for name in kept},
        parameters={name: values[name] for name in about["parameters"]},
        metrics={name: values[name] for name in about["units"]} if finished else {},
        half_widths=halves if finished else {},
    )


def _alike(values: Sequence[Any]) -> list[Any]:
    """Values as one type has them: numbers, or else texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and len(kinds) > 1:
        return [None if value is None else float(value) for value in values]
    return list(values) if len(kinds) <= 1 else [None if value is None else str(value) for value in values]

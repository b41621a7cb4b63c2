# SPDX-License-Identifier: Apache-2.0
"""The table of a study, a row a run, with units, and what it is of."""

from __future__ import annotations

import hashlib
import json
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from conveyor_sim import __version__
from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.studies.code import require_package
from conveyor_sim.studies.journal import SOURCE, read_rows, unusable
from conveyor_sim.studies.origin import ORIGIN, VERSION, WARM_UP, read_origin
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.run_file import UNITS, read_units, row_of
from conveyor_sim.studies.study import HALF_WIDTH, Seeds, Until
from conveyor_sim.support.checked_json import CHECKSUM, parsed
from conveyor_sim.support.files import MB, FileError, read_file, write_file

PARQUET = "results.parquet"
METADATA = "conveyor_sim"
"""Key of what the file says of itself."""
FIXED_UNITS = {"simulated": "s", "dt": "s", "wall": "s", "cpu": "s"}
MOST = 512 * MB
"""Bytes of a Parquet file that are read."""


@dataclass(frozen=True)
class Results:
    """The runs of a study."""

    study: str
    """Text of its file."""
    path: str
    """Path of the study file as it was run."""
    units: Mapping[str, str]
    """By metric."""
    parameters: Mapping[str, str]
    """Their units, "" where it is not known, or there is none."""
    versions: Mapping[str, str]
    rows: Sequence[RunRow]
    warm_up: float | None = None
    """s, where pilot runs have found it; None: as the study says."""
    verified: bool = True
    """False for files of older versions, which have no checksums: damage in them can't be found."""

    @property
    def name(self) -> str:
        """Return the name of the study."""
        return str(parse_overrides(self.study).get("name", ""))

    @property
    def until(self) -> Until | None:
        """Return the stopping rule of points; None: the number of seeds is fixed."""
        seeds = parse_overrides(self.study).get("seeds")
        return Seeds.model_validate(seeds).until if isinstance(seeds, dict) else None

    def unit(self, metric: str) -> str:
        """Return a metric's unit as written behind a number: "" if dimensionless."""
        return "" if self.units[metric] == "1" else self.units[metric]

    def command(self, row: RunRow) -> str:
        """Return the shell command that repeats one run."""
        return run_command(self.path, row, self.warm_up)

    @property
    def one_run_each(self) -> bool:
        """Return True if no point ran with two seeds."""
        return len({row.point for row in self.rows}) == len(self.rows)


def run_command(path: str, row: RunRow, warm_up: float | None = None) -> str:
    """Return the shell command that repeats one run of a study file. warm_up: s, if it comes from pilot runs."""
    values = [f"--set {name}={shlex.quote(text_of(value))}" for name, value in row.parameters.items()]
    warm_ups = [] if warm_up is None else [f"--warm-up {warm_up!r}"]
    return " ".join(["conveyor-sim sweep", shlex.quote(path), *values, f"--seed {row.seed}", *warm_ups])


def text_of(value: Any) -> str:
    """Return the value of a parameter as YAML text."""
    return json.dumps(value)


def read_results(path: Path) -> Results:
    """Read the folder of a study, finished or not, or its Parquet file alone. Raise StudyError if that fails."""
    if path.is_file():
        return _of_parquet(path)
    try:
        origin = read_origin(path)
    except FileError as error:
        raise unusable(path / ORIGIN, error) from None
    rows = read_rows(path, origin)
    try:
        about = read_units(path / UNITS, origin.fields, origin.has_checksum)
    except FileError as error:
        raise unusable(path / UNITS, error) from None
    versions = {"conveyor_sim": __version__, "engine": origin.fields["engine"], "sources": origin.fields[VERSION]}
    rows = [_as_asked(row, about.asked) for row in rows]
    try:
        study = read_file(path / SOURCE, 8 * MB).decode() if origin.text is None else origin.text
        results = Results(
            study, about.path, about.units, about.parameters, versions, rows, origin.warm_up, origin.has_checksum
        )
        return _fitting(results)
    except (FileError, ValueError, SceneError) as error:
        reason = error if isinstance(error, FileError) else "does not fit the runs beside it"
        raise unusable(path / (SOURCE if origin.text is None else ORIGIN), reason) from None


def _fitting(results: Results) -> Results:
    """Return the results. Raises ValueError or SceneError if its parts are not of one study."""
    if not isinstance(parse_overrides(results.study), dict) or not results.name:
        raise ValueError("no study")
    _ = results.until
    if any(row.parameters.keys() != results.parameters.keys() for row in results.rows):
        raise ValueError("other parameters")
    return results


def _as_asked(row: RunRow, asked: Mapping[str, str]) -> RunRow:
    """With the metrics of today; NaN: the run was made before it was asked for this one."""
    if row.status != "finished":
        return row
    known = {name for name, what in asked.items() if row.asked.get(name) == what}
    metrics = {name: row.metrics[name] if name in known else math.nan for name in asked}
    halves = {name: half for name, half in row.half_widths.items() if name in known}
    return replace(row, metrics=metrics, half_widths=halves)


def write_parquet(results: Results, path: Path) -> Path:
    """One file, readable by itself. Raises StudyError if it can't be written or pyarrow is missing."""
    require_package("pyarrow", "a Parquet file")
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
    made = pyarrow.Table.from_arrays([column for column, _ in columns.values()], schema=pyarrow.schema(fields))
    about[CHECKSUM] = _digest(about, made.to_pylist())
    return made.replace_schema_metadata({METADATA: json.dumps(about)})


def _of_parquet(path: Path) -> Results:
    require_package("pyarrow", str(path))
    from pyarrow import ArrowException, BufferReader, parquet

    expected = "expected an intact Parquet file of conveyor-sim sweep"
    try:
        content = read_file(path, MOST)
        table = parquet.read_table(BufferReader(content))
        about = parsed(table.schema.metadata[METADATA.encode()])
        digest, rows = about.pop(CHECKSUM, None), table.to_pylist()
        if digest is not None and digest != _digest(about, rows):
            raise StudyError(f"{path}: its checksum does not fit, {expected}")
        kept = {name: about[name] for name in ("study", "path", "units", "parameters", "versions")}
        kept[WARM_UP] = about.get(WARM_UP)
        _PARQUET.validate_python(kept)
        made = [_row(values, about) for values in rows]
        return _fitting(Results(**kept, rows=made, verified=digest is not None))
    except FileError as error:
        raise StudyError(f"{path}: {error}, {expected}") from None
    except (ArrowException, KeyError, TypeError, ValueError, AttributeError, OSError, SceneError):
        raise StudyError(f"{path}: not the results of a study, {expected}") from None


_PARQUET = TypeAdapter(dict[str, str | float | dict[str, str] | None])


def _digest(about: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a checksum over all data that are read from a Parquet file."""
    text = json.dumps([dict(about), [list(row.items()) for row in rows]])
    return hashlib.sha256(text.encode()).hexdigest()


def _row(values: Mapping[str, Any], about: Mapping[str, Any]) -> RunRow:
    """Return the run of one table row. Raises ValueError or KeyError for values of other types."""
    kept = ("point", "seed", "status", "error", *FIXED_UNITS, "bag")
    finished = values["status"] == "finished"
    halves = {name: values[name + HALF_WIDTH] for name in about["units"] if name + HALF_WIDTH in values}
    return row_of(
        {name: values[name] for name in kept}
        | {
            "parameters": {name: values[name] for name in about["parameters"]},
            "metrics": {name: values[name] for name in about["units"]} if finished else {},
            "asked": {},
            "half_widths": halves if finished else {},
        }
    )


def _alike(values: Sequence[Any]) -> list[Any]:
    """Values as one type has them: numbers, or else texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int, float} and len(kinds) > 1:
        return [None if value is None else float(value) for value in values]
    return list(values) if len(kinds) <= 1 else [None if value is None else str(value) for value in values]

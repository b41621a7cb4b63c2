# SPDX-License-Identifier: Apache-2.0
"""Files of a study folder: one per finished run, with row, origin and checksum, and the file of units."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, FiniteFloat, ValidationError

from conveyor_sim.studies.origin import ORIGIN, WARM_UP, StudyOrigin, read_study_json
from conveyor_sim.studies.row import Job, RunRow, Status
from conveyor_sim.support.checked_json import CheckedJson, with_checksum
from conveyor_sim.support.files import FileError

RUNS = "runs"
MADE_WITH = "made_with"
"""Field with the content of `study.json` without the text of the study."""

_Seconds = Annotated[FiniteFloat, Field(ge=0.0)]


class _Row(BaseModel, strict=True, extra="forbid"):
    """The types of a `RunRow` in a file; metrics may be NaN or infinite."""

    point: Annotated[int, Field(ge=0, lt=2**63)]
    seed: Annotated[int, Field(ge=0, lt=2**64)]
    parameters: dict[str, bool | int | FiniteFloat | str]
    status: Status
    error: str
    metrics: dict[str, float]
    asked: dict[str, str]
    half_widths: dict[str, float | None]
    simulated: _Seconds
    dt: _Seconds
    wall: _Seconds
    cpu: _Seconds
    bag: str


def name_of(job: Job | RunRow) -> str:
    """Return the name of the file of a run, below the folder of the study."""
    return f"{RUNS}/point_{job.point}_seed_{job.seed}.json"


def content_of(row: RunRow, made_with: Mapping[str, Any]) -> bytes:
    """Return the content of the file of a run. made_with: as `made_with` returns it."""
    return with_checksum({**json.loads(json.dumps(asdict(row), default=str)), MADE_WITH: dict(made_with)})


def made_with(fields: Mapping[str, str], warm_up: float | None) -> dict[str, Any]:
    """Return the field MADE_WITH of a file."""
    return {**fields, **({} if warm_up is None else {WARM_UP: warm_up})}


def row_of(data: Mapping[str, Any]) -> RunRow:
    """Return a row from plain data. Raises ValueError (pydantic's) for data of other types."""
    return RunRow(**dict(_Row.model_validate(dict(data))))


def read_row(folder: Path, file: Path) -> tuple[RunRow, CheckedJson]:
    """Return a run and the content of its file, with its field MADE_WITH.

    Raises FileError for a file that is damaged, or has the name of another run.
    """
    kept = read_study_json(file, finite=False)
    data = {name: value for name, value in kept.data.items() if name != MADE_WITH}
    try:
        row = row_of(data)
    except ValidationError as error:
        where = ".".join(map(str, error.errors(include_url=False)[0]["loc"]))
        raise FileError(f"{where}: is not as conveyor_sim writes it") from None
    if kept.has_checksum is not isinstance(kept.data.get(MADE_WITH), dict):
        raise FileError("does not say what it was made with")
    if file.relative_to(folder).as_posix() != name_of(row):
        raise FileError(f"holds the run of point {row.point} with seed {row.seed}")
    if row.status == "finished" and row.metrics.keys() != row.asked.keys():
        raise FileError("has other metrics than the study requested")
    return row, kept


def objection(row: RunRow, kept: CheckedJson, origin: StudyOrigin) -> str:
    """Return why a run is not one of a folder, in words that follow its file, "" if it is one."""
    if kept.has_checksum is not origin.has_checksum:
        return "has no checksum" if origin.has_checksum else "has a checksum, which study.json has not"
    if not kept.has_checksum:
        return ""
    fields = dict(kept.data[MADE_WITH])
    warm_up = fields.pop(WARM_UP, None)
    other = [what for what, value in origin.fields.items() if fields.get(what) != value]
    if other or fields.keys() != origin.fields.keys():
        return f"was made with another {' and another '.join(other) or 'version'}"
    if row.status == "finished" and warm_up != origin.warm_up:  # other runs may have failed before it was known
        return "was made with another warm-up"
    return ""


def run_files(folder: Path) -> list[Path]:
    """Return the files of finished runs in a folder, ordered by name. Raises OSError."""
    return sorted(file for file in (folder / RUNS).iterdir() if file.suffix == ".json")


UNITS = "units.json"


class Units(BaseModel, strict=True, extra="forbid"):
    """Content of the file of units: units of metrics and parameters, definitions of metrics, path of the study."""

    path: str
    """Path of the study's file when it was run."""
    asked: dict[str, str]
    """Definitions of the metrics."""
    units: dict[str, str]
    """Units of the metrics."""
    parameters: dict[str, str]
    """Units of the parameters; "": without a unit."""


def read_units(file: Path, fields: Mapping[str, str], sealed: bool) -> Units:
    """Return the content of a file of units.

    fields, sealed: of the `study.json` beside it. Raises FileError if it is damaged or of another study.
    """
    kept = read_study_json(file)
    made = kept.data.pop(MADE_WITH, None)
    if kept.has_checksum is not sealed:
        raise FileError("has no checksum" if sealed else f"has a checksum, which {ORIGIN} has not")
    if sealed and not (isinstance(made, dict) and fields.items() <= made.items()):
        raise FileError("was made with another study")
    try:
        units = Units.model_validate(kept.data)
    except ValidationError:
        raise FileError("has other fields than conveyor-sim sweep writes") from None
    if units.units.keys() != units.asked.keys():
        raise FileError("has units of other metrics than it names")
    return units

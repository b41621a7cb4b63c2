"""The file of units: units of metrics and parameters, definitions of metrics, and the path of the study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError

from conveyor_sim.studies.origin import ORIGIN, read_study_json
from conveyor_sim.studies.run_file import MADE_WITH
from conveyor_sim.support.files import FileError

UNITS = "units.json"


class Units(BaseModel, strict=True, extra="forbid"):
    """Content of the file."""

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

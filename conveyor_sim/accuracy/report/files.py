# SPDX-License-Identifier: Apache-2.0
"""A study on disk: one JSON with a checksum that holds all of it exactly, and CSV files of its rows for other programs.

`conveyor-sim sweep` writes another `study.json` (`studies/origin.py`); neither command replaces the other's file.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, cast, get_args, get_origin, get_type_hints

from conveyor_sim.accuracy.report.pareto import front
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.checked_json import read_checked, with_checksum
from conveyor_sim.support.files import FileError, write_file

_EXPECTED = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}


class Unlike(ValueError):
    """Data that is not of its kind: where, what was found, what was expected."""

    def __init__(self, where: str, found: str, expected: str) -> None:
        super().__init__(f"{where.lstrip('.') or 'all of it'}: found {found}, expected {expected}")


def plain(value: object) -> object:
    """Fields by name, lists, texts, numbers, true, false and null; infinite and undefined numbers as texts."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no number for it
    return value


def typed(kind: Any, data: Any, where: str = "") -> Any:
    """Return the value of type `kind` from which `plain` produced `data`: dataclass, tuple, dict, X | None, or scalar.

    Raise Unlike if `data` can't come from such a value.
    """
    inner = get_args(kind)
    if get_origin(kind) is UnionType:
        return None if data is None else typed(next(k for k in inner if k is not NoneType), data, where)
    if get_origin(kind) is tuple:
        return _tuple(inner, data, where)
    if get_origin(kind) is dict:
        _expect(isinstance(data, dict), where, data, "fields by name")
        return {name: typed(inner[1], item, f"{where}.{name}") for name, item in data.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        kinds = get_type_hints(kind)
        _expect(isinstance(data, dict), where, data, f"the fields {', '.join(kinds)}")
        # What has a default may be left out: a file of a version that did not have the field yet.
        optional = {field.name for field in fields(kind) if field.default is not MISSING}
        for name in (kinds.keys() ^ data.keys()) - (optional - data.keys()):
            found = f"the field {name}" if name in data else f"no field {name}"
            raise Unlike(where, found, f"the fields {', '.join(kinds)}")
        return kind(**{name: typed(k, data[name], f"{where}.{name}") for name, k in kinds.items() if name in data})
    if kind is float and (type(data) is int or data in ("inf", "-inf", "nan")):
        return float(data)
    _expect(type(data) is kind, where, data, _EXPECTED[kind])
    return data


def _tuple(kinds: tuple[Any, ...], data: Any, where: str) -> tuple[Any, ...]:
    _expect(isinstance(data, list), where, data, "a list")
    if kinds[-1] is Ellipsis:
        kinds = kinds[:1] * len(data)
    _expect(len(data) == len(kinds), where, data, f"a list of {len(kinds)}")
    return tuple(typed(kind, item, f"{where}[{i}]") for i, (kind, item) in enumerate(zip(kinds, data, strict=True)))


def _expect(holds: bool, where: str, data: object, expected: str) -> None:
    if not holds:
        text = json.dumps(data)
        raise Unlike(where, text if len(text) <= 40 else f"{text[:37]}...", expected)


STUDY = "study.json"

Table = list[dict[str, object]]


def write_study(study: AccuracyStudy, out_dir: str | Path) -> list[Path]:
    """Write study.json and a CSV file for each kind of row that the study has, each whole or not at all.

    Headings of the CSV files end in the unit, relative numbers have none. The finished runs are not among them: a
    SampleFile holds them. Returns the files; ConveyorError if one can't be written.
    """
    out = Path(out_dir)
    contents = {STUDY: with_checksum(cast("dict[str, object]", plain(study)), indent=1)}
    contents |= {f"{name}.csv": _csv(table).encode() for name, table in _tables(study).items() if table}
    for name, content in contents.items():
        write(out / name, content)
    return [out / name for name in contents]


def read_study(path: str | Path, say: Callable[[str], object] = lambda _: None) -> AccuracyStudy:
    """Read a study from study.json; it equals the one that was written.

    say: called with one sentence for a file of an older version, which has no checksum and can't be verified.
    Raise ConveyorError if the file can't be read, is damaged or holds no study.
    """
    try:
        kept = read_checked(Path(path))
    except FileError as error:
        raise ConveyorError(
            f"{path}: {error}, expected an intact {STUDY} of a study of conveyor-sim accuracy"
        ) from None
    try:
        study = typed(AccuracyStudy, kept.data)
    except Unlike as unlike:
        raise ConveyorError(f"{path}: {unlike}") from None
    assert isinstance(study, AccuracyStudy)
    if not kept.has_checksum:
        say(f"{path}: was made by an older version without checksums, so it can't be verified")
    return study


def write(file: Path, content: bytes) -> None:
    """Write a file in one go, and make its folder. Raises ConveyorError if it can't be written."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_file(file, content)
    except (FileError, OSError) as error:
        reason = error if isinstance(error, FileError) else f"can't be written ({error.strerror})"
        raise ConveyorError(f"{file}: {reason}, expected a folder to write to") from None


def _tables(study: AccuracyStudy) -> dict[str, Table]:
    """Rows of each CSV file, by its name: a dict a row, all of a table with the same headings."""
    best = {point.setting for point in front(study.points)}
    recommended = None if study.answer is None else study.answer.setting
    return {
        "points": [
            {
                **_setting(point.setting),
                "dt_s": point.dt,
                "predicted_error": point.predicted,
                "predicted_resting_error": point.predicted_resting,
                "resting_error": point.resting,
                "step_over_bound_of_stability": point.beyond,
                "position_rms_error_m": point.errors and point.errors.position_rms,
                "position_max_error_m": point.errors and point.errors.position_max,
                "peak_force_error": point.errors and point.errors.peak_force,
                "impulse_error": point.errors and point.errors.impulse,
                "energy_error": point.errors and point.errors.energy,
                "cost_s_per_s": point.cost and point.cost.median,
                "least_cost_s_per_s": point.cost and point.cost.least,
                "greatest_cost_s_per_s": point.cost and point.cost.greatest,
                "front": point.setting in best,
                "recommended": point.setting == recommended,
                "own": point.setting == study.own,
                "failure": point.failure,
            }
            for point in study.points
        ],
        "orders": [
            {
                "case": order.case,
                "quantity": order.quantity,
                "integrator": order.integrator,
                "steps": steps,
                "error": error,
                "phases": order.phases,
                "observed_order": order.observed,
                "expected_order": order.expected,
            }
            for order in study.orders
            for steps, error in zip(order.steps, order.errors, strict=True)
        ],
        "resting": [
            {
                "reason": study.rest.reason,
                **({} if study.rest.setting is None else _setting(study.rest.setting)),
                "doubt": study.rest.doubt,
                "window_s": study.rest.window,
                "contacts": study.rest.contacts,
                "force_N": study.rest.force,
            }
        ]
        if study.rest is not None
        else [],
        "horizons": [
            {
                "start_s": horizon.start,
                "bottles": horizon.bottles,
                "contacts": horizon.contacts,
                "by_nudge_s": horizon.by_nudge,
                "by_error_s": horizon.by_error,
                "length_s": horizon.length,
            }
            for horizon in study.horizons
        ],
        "comparisons": [
            {
                **_setting(row.setting),
                "observable": row.observable,
                "runs": row.runs,
                "mean": row.mean,
                "standard_error": row.error,
                "reference": row.reference,
                "reference_standard_error": row.reference_error,
                "low": row.low,
                "high": row.high,
                "tolerance": row.tolerance,
                "verdict": row.verdict,
            }
            for row in study.comparisons
        ],
        "flow": [
            {
                **_setting(row.setting),
                "cost_s_per_s": row.cost,
                "largest_overlap": row.overlap,
                "stop_force_difference": row.stop_force,
                "throughput_low": row.throughput and row.throughput.low,
                "throughput_high": row.throughput and row.throughput.high,
                "single_forces_error": row.single_forces,
                "measured": row.measured,
                "verdict": row.verdict,
                "recommended": row.setting == study.flow.setting,
                "reason": row.reason,
            }
            for row in study.flow.rows
        ]
        if study.flow is not None
        else [],
        "stiffness": [
            {
                "factor": row.factor,
                "dt_s": row.dt,
                "overlap": row.overlap,
                "cost_ratio": row.cost_ratio,
                "observable": name,
                "mean": mean,
                "standard_error": error,
            }
            for row in study.stiffness
            for name, (mean, error) in (row.observables or {"": (math.nan, math.nan)}).items()
        ],
    }


def _setting(setting: Setting) -> dict[str, object]:
    return {
        "integrator": setting.integrator,
        "per_tick": setting.per_tick,
        "stiffness": setting.stiffness,
        "error_of_a_step_m_per_s": setting.error,
        "sweeps": setting.sweeps,
    }


def _csv(table: Table) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(table)
    return text.getvalue()

# SPDX-License-Identifier: Apache-2.0
"""Files of measurements in tests."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path

from conveyor_sim.studies.calibration.read import Measurement

UNITS = {
    "force": "N", "normal_force": "N", "mass": "kg", "speed": "m/s", "drop_height": "m", "rebound_height": "m",
    "length": "m", "angle_before": "rad", "angle_after": "rad", "angle_struck": "rad", "overlap": "m",
    "acceleration": "m/s^2", "frequency": "Hz", "direction": "rad",
}  # fmt: skip
"""SI units, so that tests write the values of `Measurement`."""


def measurement(line: int, kind: str, sample: str = "", other: str = "steel", **values: float) -> Measurement:
    """Return a row for glass and another material."""
    return Measurement(line, kind, ("glass", other), sample, values)


def write(path: Path, rows: Iterable[Mapping[str, object]]) -> Path:
    """Write rows of texts and SI values as a CSV file, and return its path."""
    rows = list(rows)
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow([f"{name} ({UNITS[name]})" if name in UNITS else name for name in names])
        writer.writerows([[row.get(name, "") for name in names] for row in rows])
    return path

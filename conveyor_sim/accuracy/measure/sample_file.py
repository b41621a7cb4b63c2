# SPDX-License-Identifier: Apache-2.0
"""Finished runs on disk, a line each: a study that was interrupted goes on where it was."""

from __future__ import annotations

import csv
import hashlib
import io
from pathlib import Path
from types import ModuleType
from typing import Any

from conveyor_sim.accuracy import setting
from conveyor_sim.accuracy.measure import jitter, observables
from conveyor_sim.accuracy.measure.observables import OBSERVABLES
from conveyor_sim.accuracy.results import Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.columns import itinerary
from conveyor_sim.engine.compiler.compile import ENGINE_HASH
from conveyor_sim.errors import ConveyorError
from conveyor_sim.physics.sources_hash import sources_hash
from conveyor_sim.scene import Scene
from conveyor_sim.support.checked_json import read_checked, with_checksum
from conveyor_sim.support.files import MB, FileError, read_file, write_file

SAMPLES = "samples.csv"
MOST = 512 * MB
"""Bytes of that file that are read."""
ORIGIN = "origin.json"
"""File with the origin of a folder's results: hashes that a study must share to continue with them."""

_OF_SETTING = ("integrator", "per_tick", "stiffness", "error", "sweeps")
_COLUMNS = (*_OF_SETTING, "seed", *(observable.name for observable in OBSERVABLES), "cpu", "failure", "checksum")
"""The checksum of a line covers its other columns, the scene and the version."""
OTHER_STUDY = "study.json"
"""File that `conveyor-sim sweep` writes first into a folder."""


class SampleFile:
    """The finished runs of one scene in a folder: `samples.csv`, one line a run."""

    def __init__(self, folder: Path, scene: Scene) -> None:
        """Read what is there, less a last line that was cut short, and go on behind it.

        Raises ConveyorError if the runs are of another scene or another version, or the folder can't be written.
        """
        self.path, self._of = folder / SAMPLES, fingerprint(scene)
        try:
            check_origin(folder, scene)
            kept = self._whole_lines()
            self.found = _parsed(kept, self.path, self._of)
            """Runs that were there, in the order in which they were finished."""
            self._file = open(self.path, "ab")  # noqa: SIM115 (closed by close)
            self._file.truncate(len(kept))
            if not kept:
                self._write(_line(_COLUMNS))
        except OSError as error:
            raise _unwritable(folder, error) from None

    def append(self, sample: Sample) -> None:
        """Add a finished run; when this returns, it is with the operating system."""
        way = sample.setting
        error = "" if way.error is None else repr(way.error)
        values = [repr(sample.values[item.name]) if item.name in sample.values else "" for item in OBSERVABLES]
        line = _line(
            (way.integrator, way.per_tick, repr(way.stiffness), error, way.sweeps or "", sample.seed, *values,
             repr(sample.cpu), sample.failure)
        )  # fmt: skip
        self._write(line[:-1] + f",{_checksum(line, self._of)}\n")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, line: str) -> None:
        self._file.write(line.encode())
        self._file.flush()

    def _whole_lines(self) -> bytes:
        try:
            content = read_file(self.path, MOST) if self.path.is_symlink() or self.path.exists() else b""
        except FileError as error:
            raise ConveyorError(f"{self.path}: {error}, expected a file of finished runs, or no such file") from None
        return content[: content.rfind(b"\n") + 1]


def check_origin(folder: Path, scene: Scene) -> None:
    """Make sure that what is in a folder, or will be, is of this scene and this version; the folder is made.

    Raises ConveyorError if it is not, or the folder can't be written.
    """
    origin, path = _origin(scene), folder / ORIGIN
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists() and (folder / OTHER_STUDY).exists():
            raise ConveyorError(f"{folder}: has another kind of study ({OTHER_STUDY}), expected another folder")
        if not path.exists() and not (folder / SAMPLES).exists():
            write_file(path, with_checksum(origin, indent=2))
    except OSError as error:
        raise _unwritable(folder, error) from None
    except FileError as error:
        raise ConveyorError(f"{path}: {error}, expected a folder to write to") from None
    try:
        kept = read_checked(path)
    except FileError as error:
        raise ConveyorError(
            f"{path}: {error}, so the origin of the runs beside it is unknown; expected the file as it was, "
            "another folder, or this one emptied to begin anew"
        ) from None
    other = [what for what, value in origin.items() if kept.data.get(what) != value]
    if other or not kept.has_checksum:
        other = other or ["version of conveyor_sim"]
        raise ConveyorError(
            f"{path}: its runs were made with another {' and another '.join(other)}, so they can't be compared with "
            "new ones; expected another folder, or this one emptied to begin anew"
        )


def fingerprint(scene: Scene) -> str:
    """Return a short text that identifies a scene and a version."""
    return _hash(*(value.encode() for value in _origin(scene).values()))[:8]


def _unwritable(folder: Path, error: OSError) -> ConveyorError:
    return ConveyorError(f"{error.filename or folder}: {error.strerror}, expected a folder to write to")


def _origin(scene: Scene) -> dict[str, str]:
    """Return the data that decide a run, beside its setting and seed."""
    return {
        "scene": _hash(scene.source_text.encode(), scene.overrides_text.encode()),
        "engine": ENGINE_HASH,
        "version of conveyor_sim": sources_hash(),
        "definition of settings": _hash_of_sources(setting),
        "definition of observables": _hash_of_sources(observables, jitter, itinerary),
    }


def _hash_of_sources(*modules: ModuleType) -> str:
    return _hash(*(Path(str(module.__file__)).read_bytes() for module in modules))


def _hash(*parts: bytes) -> str:
    return hashlib.blake2b(b"\0".join(parts), digest_size=8).hexdigest()


def _line(row: Any) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(row)
    return line.getvalue()


def _checksum(line: str, of: str) -> str:
    """Return the checksum of a line without this column."""
    return _hash(line.encode(), of.encode())


def _parsed(content: bytes, path: Path, of: str) -> list[Sample]:
    try:
        rows = list(csv.reader(io.StringIO(content.decode(), newline="")))
        if rows and tuple(rows[0]) != _COLUMNS:
            raise ValueError
        damaged = [number for number, row in enumerate(rows[1:], 2) if row[-1:] != [_checksum(_line(row[:-1]), of)]]
        if damaged:
            raise ConveyorError(
                f"{path}: line {damaged[0]} of {len(rows)}: not a finished run of this scene as conveyor_sim writes it "
                f"(its checksum does not fit; {len(damaged)} such lines), expected the line as it was; without it, its "
                "run is made again"
            )
        return [_sample(dict(zip(_COLUMNS, row, strict=True))) for row in rows[1:]]
    except (ValueError, csv.Error):
        raise ConveyorError(
            f"{path}: not a file of finished runs as conveyor_sim writes it; expected another folder, or the file "
            "removed to begin anew"
        ) from None


def _sample(row: dict[str, str]) -> Sample:
    return Sample(
        setting=Setting(
            row["integrator"],
            int(row["per_tick"]),
            float(row["stiffness"]),
            float(row["error"]) if row["error"] else None,
            int(row["sweeps"]) if row["sweeps"] else None,
        ),
        seed=int(row["seed"]),
        values={item.name: float(row[item.name]) for item in OBSERVABLES if row[item.name]},
        cpu=float(row["cpu"]),
        failure=row["failure"],
    )

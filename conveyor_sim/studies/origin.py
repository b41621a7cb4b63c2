# SPDX-License-Identifier: Apache-2.0
"""Origin of the runs of a folder: `study.json`, and the same fields in each file of a run."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import Study
from conveyor_sim.support.checked_json import CheckedJson, read_checked, with_checksum
from conveyor_sim.support.files import MB, FileError

ORIGIN = "study.json"
WARM_UP = "warm_up"
"""s, as pilot runs have found it."""
VERSION = "version of conveyor_sim"
TEXT = "text"
"""Text of the study's file, in ORIGIN."""
FREE = ("description", "seeds", "bags", "metrics", "optimise", "points")
"""Fields of a study that may change while its finished runs stay: all but these decide a run."""
MOST = 16 * MB
"""Bytes of a JSON file of a study that are read."""

_FIELDS = ("study", "scene", "code", "engine", VERSION)


@dataclass(frozen=True)
class StudyOrigin:
    """Content of a `study.json`."""

    fields: Mapping[str, str]
    """Hashes of the inputs that decide a run beside its parameters and seed, by name."""
    warm_up: float | None
    """s; None: not found yet, or not needed."""
    text: str | None
    """Text of the study's file; None in files of older versions."""
    has_checksum: bool
    """False in files of older versions, which have no checksum."""

    def content(self) -> bytes:
        """Return the content of the file."""
        warm_up = {} if self.warm_up is None else {WARM_UP: self.warm_up}
        return with_checksum({**self.fields, **warm_up, TEXT: self.text}, indent=1)


def origin_of(setup: Setup) -> dict[str, str]:
    """Return hashes of the inputs that decide a run beside its parameters and seed, by name."""
    return {
        "study": _hash(json.dumps(deciding(setup.study), sort_keys=True)),
        "scene": _hash(setup.text, setup.overrides),
        "code": _hash(*(f"{Path(file).name} {setup.code[file]}" for file in setup.made_by)),
        "engine": setup.versions[0],
        VERSION: setup.versions[1],
    }


def deciding(study: Study) -> dict[str, Any]:
    """Return the fields of a study that decide its runs."""
    return study.model_dump(mode="json", exclude=set(FREE))


def fingerprint(setup: Setup) -> str:
    """Return a short text by which a study and a version differ from all others."""
    return _hash(*origin_of(setup).values())[:8]


def read_origin(folder: Path) -> StudyOrigin:
    """Return the content of a folder's `study.json`. Raises FileError; StudyError for a file of another kind."""
    kept = read_study_json(folder / ORIGIN)
    data = dict(kept.data)
    warm_up, text = data.pop(WARM_UP, None), data.pop(TEXT, None)
    sound = tuple(data) == _FIELDS and all(isinstance(value, str) for value in data.values())
    sound = sound and (warm_up is None or (type(warm_up) in (int, float) and math.isfinite(warm_up) and warm_up >= 0.0))
    if not sound or isinstance(text, str) is not kept.has_checksum:
        if kept.has_checksum or "scene" not in data or "study" not in data:
            raise StudyError(
                f"{folder / ORIGIN}: is not that of conveyor-sim sweep or optimise (conveyor-sim accuracy has one of "
                "the same name), expected the folder of a study"
            )
        raise FileError("has other fields than conveyor-sim sweep writes")
    return StudyOrigin(data, warm_up, text, kept.has_checksum)


def read_study_json(path: Path, finite: bool = True) -> CheckedJson:
    """Return the content of a JSON file of a study. Raises FileError."""
    return read_checked(path, MOST, finite)


def _hash(*parts: str) -> str:
    return blake2b("\0".join(parts).encode(), digest_size=8).hexdigest()

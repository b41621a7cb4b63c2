"""The folder of a study: each finished run in a file of its own, so that none is ever lost."""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, fields
from hashlib import blake2b
from pathlib import Path
from typing import Any

from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.studies.row import BAGS, Job, Pilot, Row
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import Study
from conveyor_sim.support.files import FileError, write_file

ORIGIN = "study.json"
"""What a folder's runs are of."""
SOURCE = "study.yaml"
RUNS = "runs"
STARTS = "warm_starts"
PILOTS = "pilots"
"""Runs that find the warm-up."""
WARM_UP = "warm_up"
"""What they have found, in ORIGIN."""
VERSION = "version of conveyor_sim"
UNITS = "units.json"
"""Of metrics and parameters, what each metric is, and the path of the study."""
ASKED = "asked"
"""What each metric is, in UNITS."""
FREE = ("description", "seeds", "bags", "metrics", "optimise", "points")
"""Fields of a study that may change while its finished runs stay: all but these decide a run."""

_FIELDS = {item.name for item in fields(Row)}


class Journal(AbstractContextManager["Journal"]):
    """The finished runs of one study, by their keys. One process at a time writes it."""

    def __init__(self, folder: Path, setup: Setup) -> None:
        """Read what is there. The folder is made.

        Raises StudyError if it has runs of another study or version, another process works on it, or it can't be
        written.
        """
        self.folder = folder
        self._setup, self._asked = setup, setup.asked
        self.warm_up: float | None = None
        """s, as pilot runs have found it; None: they have not yet, or need not."""
        try:
            (folder / RUNS).mkdir(parents=True, exist_ok=True)
            self._lock = open(folder / ".lock", "ab")  # noqa: SIM115 (closed by __exit__)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise StudyError(f"{folder}: another process works on this study, expected it to end first") from None
            except OSError:
                pass  # a file system without locks
            self._check_origin()
            for cut_short in (folder / BAGS).glob(".*"):  # by a process that was killed
                shutil.rmtree(cut_short, ignore_errors=True)
            self.rows = {row.key: row for row in read_rows(folder) if row.status != "lost"}
            """Those that were there, and those added since."""
        except OSError as error:
            raise StudyError(f"{error.filename or folder}: {error.strerror}, expected a folder to write to") from None

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    def row_of(self, job: Job) -> Row | None:
        """What came of a run before; None if it is to be made. Raises StudyError if it was made of other values."""
        row = self.rows.get(job.key)
        if row is not None and dict(row.parameters) != dict(job.parameters):
            raise StudyError(
                f"{self.folder}: point {job.point} was made with {dict(row.parameters)}, not {dict(job.parameters)}; "
                "expected another folder, or this one emptied to begin anew"
            )
        if row is not None and row.asked != self._asked:  # one that failed may have done so in a metric
            has_all = row.status == "finished" and self._asked.items() <= row.asked.items()
            return row if has_all else None
        return row

    def add(self, row: Row) -> None:
        """Keep a run; when this returns, it is on the disk. Raises StudyError if it can't be written."""
        self._write(Path(RUNS) / f"point_{row.point}_seed_{row.seed}.json", json.dumps(asdict(row), default=str))
        self.rows[row.key] = row

    def start_of(self, seed: int) -> Path:
        """Where the warm start of a seed is kept, once it is there: one for each set of effects that metrics force."""
        forced = "".join(f"_{effect}" for effect in sorted(self._setup.needs({}).get("effects", {})))
        return self.folder / STARTS / f"seed_{seed}{forced}.npz"

    def keep_start(self, seed: int, content: bytes) -> None:
        """Keep a warm start. Raises StudyError if it can't be written."""
        self._write(self.start_of(seed).relative_to(self.folder), content)

    def pilot_of(self, job: Job) -> Pilot | None:
        """What a pilot run has shown before; None if it is to be made."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            found = json.loads((self.folder / _pilot(job)).read_text(encoding="utf-8"))
            if (found["parameters"], found["asked"]) == (dict(job.parameters), self._asked):
                return Pilot(found["part"], found["series"])
        return None

    def keep_pilot(self, job: Job, made: Pilot) -> None:
        """Keep a pilot run. Raises StudyError if it can't be written."""
        about = {"parameters": dict(job.parameters), "asked": self._asked}
        self._write(_pilot(job), json.dumps({**about, **asdict(made)}))

    def keep_warm_up(self, seconds: float) -> None:
        """Keep what pilot runs have found: that of all runs in the folder. Raises StudyError if it can't be written."""
        self._write(Path(ORIGIN), json.dumps({**origin_of(self._setup), WARM_UP: seconds}, indent=1))
        self.warm_up = seconds

    @property
    def has_units(self) -> bool:
        """Whether those are kept that belong to the metrics of today."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            found = json.loads((self.folder / UNITS).read_text(encoding="utf-8"))
            return bool((found["path"], found[ASKED]) == (self._setup.path, self._asked))
        return False

    def keep_units(self, metrics: Mapping[str, str], parameters: Mapping[str, str]) -> None:
        """Keep the units of metrics and parameters. Raises StudyError if they can't be written."""
        units = {"units": dict(metrics), "parameters": dict(parameters)}
        about = {"path": self._setup.path, ASKED: self._asked, **units}
        self._write(Path(UNITS), json.dumps(about, indent=1))

    def _write(self, name: Path, content: str | bytes) -> None:
        path = self.folder / name
        try:
            path.parent.mkdir(exist_ok=True)
            write_file(path, content.encode() if isinstance(content, str) else content)
        except (FileError, OSError) as error:
            reason = error if isinstance(error, FileError) else f"can't be written ({error.strerror})"
            raise StudyError(
                f"{path}: {reason}; {len(self.rows)} finished runs are kept, and the same command goes on with them"
            ) from None

    def _check_origin(self) -> None:
        origin, path = origin_of(self._setup), self.folder / ORIGIN
        found: Any = None
        if path.exists():
            with suppress(ValueError):
                found = json.loads(path.read_text(encoding="utf-8"))
        elif any((self.folder / RUNS).iterdir()):
            found = {}
        if found is None:
            self.rows = {}
            self._write(Path(ORIGIN), json.dumps(origin, indent=1))
            self._keep_source()
            return
        self.warm_up = found.get(WARM_UP) if isinstance(found, dict) else None
        other = [what for what, value in origin.items() if not isinstance(found, dict) or found.get(what) != value]
        if other:
            fields = ", ".join(self._other_fields())
            named = [f"{what} ({fields})" if what == "study" and fields else what for what in other]
            raise StudyError(
                f"{self.folder}: its runs were made with another {' and another '.join(named)}, so they can't be "
                "compared with new ones; expected another folder, or this one emptied to begin anew"
            )
        self._keep_source()

    def _other_fields(self) -> list[str]:
        """Of the study, those that decide a run and are others than where its runs were made."""
        with suppress(OSError, ValueError, SceneError):
            before = Study.model_validate(parse_overrides((self.folder / SOURCE).read_text(encoding="utf-8")))
            then, now = _deciding(before), _deciding(self._setup.study)
            return [name for name, value in now.items() if then[name] != value]
        return []

    def _keep_source(self) -> None:
        """The study as it is now: some of its fields may have changed since the folder was made."""
        with suppress(OSError, ValueError):
            if (self.folder / SOURCE).read_text(encoding="utf-8") == self._setup.source:
                return
        self._write(Path(SOURCE), self._setup.source)


def _pilot(job: Job) -> Path:
    return Path(PILOTS) / f"point_{job.point}_seed_{job.seed}.json"


def origin_of(setup: Setup) -> dict[str, str]:
    """What decides a run beside its parameters and seed, by what it is."""
    return {
        "study": _hash(json.dumps(_deciding(setup.study), sort_keys=True)),
        "scene": _hash(setup.text, setup.overrides),
        "code": _hash(*(f"{Path(file).name} {setup.code[file]}" for file in setup.made_by)),
        "engine": setup.engine,
        VERSION: setup.sources,
    }


def _deciding(study: Study) -> dict[str, Any]:
    """The fields of a study that decide its runs."""
    return study.model_dump(mode="json", exclude=set(FREE))


def fingerprint(setup: Setup) -> str:
    """A short text by which a study and a version differ from all others."""
    return _hash(*origin_of(setup).values())[:8]


def read_rows(folder: Path) -> list[Row]:
    """The finished runs in a folder, in the order of their keys. Raises StudyError for what is no such folder."""
    rows = []
    try:
        files = [*(folder / RUNS).iterdir()]
    except OSError as error:
        raise StudyError(f"{folder}: {error.strerror}, expected the folder of a study") from None
    for file in files:
        if file.suffix != ".json":
            continue  # an unfinished one of a process that was killed
        try:
            data = json.loads(file.read_text(encoding="utf-8"))
            if set(data) != _FIELDS:
                raise ValueError
            rows.append(Row(**data))
        except (ValueError, TypeError, OSError):
            raise StudyError(
                f"{file}: not a run as conveyor_sim writes it, expected it removed to make it anew"
            ) from None
    return sorted(rows, key=lambda row: row.key)


def _hash(*parts: str) -> str:
    return blake2b("\0".join(parts).encode(), digest_size=8).hexdigest()

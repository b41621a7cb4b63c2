# SPDX-License-Identifier: Apache-2.0
"""Folder of a study: one file per finished run, so that no finished run is lost."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import parse_overrides
from conveyor_sim.studies.origin import ORIGIN, WARM_UP, StudyOrigin, deciding, origin_of, read_origin, read_study_json
from conveyor_sim.studies.row import BAGS, Job, Pilot, RunRow
from conveyor_sim.studies.run_file import (
    MADE_WITH,
    RUNS,
    UNITS,
    Units,
    content_of,
    made_with,
    name_of,
    objection,
    read_row,
    read_units,
    run_files,
)
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import Study
from conveyor_sim.support.checked_json import CheckedJson, with_checksum
from conveyor_sim.support.file_lock import lock
from conveyor_sim.support.files import MB, FileError, read_file, write_file

SOURCE = "study.yaml"
"""The study as text, for people: commands read it in ORIGIN."""
STARTS = "warm_starts"
PILOTS = "pilots"
"""Runs that find the warm-up."""
ACCURACY = "origin.json"
"""A file that `conveyor-sim accuracy` writes first into a folder."""
ASIDE = ".unusable"
"""Added to the name of a file that is damaged or of another study. Such a file is kept and never read."""
NAMED = 10
"""Unusable files that are named one by one."""
LARGEST_START = 512 * MB


class Journal(AbstractContextManager["Journal"]):
    """The finished runs of one study, by their keys. One process at a time writes it."""

    def __init__(self, folder: Path, setup: Setup, say: Callable[[str], object] = lambda _: None) -> None:
        """Read the folder, or make it. A file that is damaged, or of another study, is set aside and named.

        say: called with one sentence for each such file. Raises StudyError if the runs are of another study or version,
        another process works on the folder, or it can't be written.
        """
        self.folder = folder
        self._setup, self._asked, self._say, self._aside = setup, setup.asked, say, 0
        self.warm_up: float | None = None
        """s, as pilot runs have found it; None: they have not yet, or need not."""
        self.rows: dict[tuple[int, int], RunRow] = {}
        """Finished runs, including runs added since the start."""
        try:
            (folder / RUNS).mkdir(parents=True, exist_ok=True)
            self._lock = open(folder / ".lock", "ab")  # noqa: SIM115 (closed by __exit__)
            try:
                lock(self._lock)
            except BlockingIOError:
                raise StudyError(f"{folder}: another process works on this study, expected it to end first") from None
            try:
                self._read()
            except BaseException:
                self._lock.close()
                raise
            for cut_short in (folder / BAGS).glob(".*"):  # by a process that was killed
                shutil.rmtree(cut_short, ignore_errors=True)
        except OSError as error:
            raise StudyError(f"{error.filename or folder}: {error.strerror}, expected a folder to write to") from None

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    def row_of(self, job: Job) -> RunRow | None:
        """Return the stored row of a run; None if it has to run. Raise StudyError if it ran with other values."""
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

    def add(self, row: RunRow) -> None:
        """Keep a run; when this returns, it is on the disk. Raises StudyError if it can't be written."""
        self._write(Path(name_of(row)), content_of(row, self._made_with))
        self.rows[row.key] = row

    def start_of(self, seed: int) -> Path:
        """Return the path of the warm start of a seed: one for each set of effects that metrics force."""
        forced = "".join(f"_{effect}" for effect in sorted(self._setup.needs({}).get("effects", {})))
        return self.folder / STARTS / f"seed_{seed}{forced}.npz"

    def has_start(self, seed: int) -> bool:
        """Return True if the warm start of a seed is there and intact."""
        start = self.start_of(seed)
        mark = start.with_suffix(".json")
        try:
            digest = self._own(mark).get("start")
        except FileError as error:
            self._set_aside(mark, str(error))
            self._set_aside(start, f"has no intact {mark.name} beside it")
            return False
        try:
            if digest == hashlib.sha256(read_file(start, LARGEST_START)).hexdigest():
                return True
            reason = f"does not fit the checksum in {mark.name}"
        except FileError as error:
            reason = str(error)
        self._set_aside(start, reason)
        return False

    def keep_start(self, seed: int, content: bytes) -> None:
        """Keep a warm start. Raises StudyError if it can't be written."""
        start = self.start_of(seed).relative_to(self.folder)
        self._write(start, content)
        mark = {"start": hashlib.sha256(content).hexdigest()}
        self._write(start.with_suffix(".json"), with_checksum({**mark, MADE_WITH: self._made_with}))

    def pilot_of(self, job: Job) -> Pilot | None:
        """Return the stored result of a pilot run; None if it has to run."""
        file = self.folder / _pilot(job)
        try:
            found = self._own(file, finite=False)
            if (found.get("parameters"), found.get("asked")) == (dict(job.parameters), self._asked):
                return Pilot(found["part"], found["series"])
        except FileError as error:
            self._set_aside(file, str(error))
        return None

    def keep_pilot(self, job: Job, made: Pilot) -> None:
        """Keep a pilot run. Raises StudyError if it can't be written."""
        about = {"parameters": dict(job.parameters), "asked": self._asked}
        self._write(_pilot(job), with_checksum({**about, **asdict(made), MADE_WITH: self._made_with}))

    def keep_warm_up(self, seconds: float) -> None:
        """Keep what pilot runs have found: that of all runs in the folder. Raises StudyError if it can't be written."""
        self.warm_up = seconds
        self._write_origin()

    @property
    def has_units(self) -> bool:
        """Return True if the stored units belong to the present metrics."""
        file = self.folder / UNITS
        try:
            found = read_units(file, origin_of(self._setup), True)
            same = (found.path, found.asked) == (self._setup.path, self._asked)
            return same and found.parameters.keys() == self._setup.study.parameters.keys()
        except FileError as error:
            self._set_aside(file, str(error))
            return False

    def keep_units(self, metrics: Mapping[str, str], parameters: Mapping[str, str]) -> None:
        """Keep the units of metrics and parameters. Raises StudyError if they can't be written."""
        found = Units(path=self._setup.path, asked=dict(self._asked), units=dict(metrics), parameters=dict(parameters))
        self._write(Path(UNITS), with_checksum({**dict(found), MADE_WITH: self._made_with}, indent=1))

    @property
    def _made_with(self) -> dict[str, Any]:
        return made_with(origin_of(self._setup), self.warm_up)

    def _write(self, name: Path, content: bytes) -> None:
        path = self.folder / name
        try:
            path.parent.mkdir(exist_ok=True)
            write_file(path, content)
        except (FileError, OSError) as error:
            reason = error if isinstance(error, FileError) else f"can't be written ({error.strerror})"
            raise StudyError(
                f"{path}: {reason}; {len(self.rows)} finished runs are kept, and the same command goes on with them; "
                "expected a file to write, and room for it"
            ) from None

    def _write_origin(self) -> None:
        """Write the origin of the runs, and the present text of the study, because its FREE fields may have changed."""
        origin = StudyOrigin(origin_of(self._setup), self.warm_up, self._setup.source, True)
        file = self.folder / ORIGIN
        with suppress(FileError):
            if read_file(file, 2 * len(origin.content())) == origin.content():
                return
        self._write(Path(ORIGIN), origin.content())

    def _own(self, file: Path, finite: bool = True) -> dict[str, Any]:
        """Return the content of a file with the same origin as this study. Raises FileError."""
        kept = read_study_json(file, finite)
        made = kept.data.pop(MADE_WITH, None)
        if not kept.has_checksum or not isinstance(made, dict):
            raise FileError("has no checksum")
        if any(made.get(what) != value for what, value in origin_of(self._setup).items()):
            raise FileError("was made with another study")
        return kept.data

    def _set_aside(self, file: Path, reason: str) -> None:
        """Rename an unusable file, if it exists, so that nothing is lost when it is made again."""
        if not file.is_symlink() and not file.exists():
            return
        names = (file.with_name(f"{file.name}{ASIDE}{number or ''}") for number in range(10_000))
        free = next(name for name in names if not name.is_symlink() and not name.exists())
        file.rename(free)
        self._aside += 1
        if self._aside <= NAMED:
            self._say(f"{file}: {reason}; it is kept as {free.name} and made again")
        elif self._aside == NAMED + 1:
            self._say(f"{file.parent}: more such files are kept as *{ASIDE} and made again")

    def _read(self) -> None:
        """Read the origin and the runs. Set unusable files aside."""
        origin, wanted = self.folder / ORIGIN, origin_of(self._setup)
        if (self.folder / ACCURACY).exists():
            raise StudyError(f"{self.folder}: has a study of conveyor-sim accuracy, expected another folder")
        found: StudyOrigin | None = None
        try:
            found = read_origin(self.folder)
            if found.fields != wanted:
                raise self._of_another(found.fields)
            self.warm_up = found.warm_up
            if not found.has_checksum:
                raise FileError("has no checksum")
            reason = ""
        except FileError as error:
            reason = str(error)
        runs = list(_runs_in(self.folder))
        if reason and any(not isinstance(run, FileError) for _, run in runs):
            self.warm_up = self._warm_up_of(runs, wanted)
            if not origin.exists():
                self._say(f"{origin}: {reason}; it is restored from the origin that the runs state")
        if reason:
            self._set_aside(origin, reason)
        own = StudyOrigin(wanted, self.warm_up, self._setup.source, True)
        for file, run in runs:
            problem = str(run) if isinstance(run, FileError) else objection(*run, own)
            if problem:
                self._set_aside(file, problem)
            elif not isinstance(run, FileError) and run[0].status != "lost":
                self.rows[run[0].key] = run[0]
        self._write_origin()
        self._keep_source()

    def _warm_up_of(self, runs: _Runs, wanted: Mapping[str, str]) -> float | None:
        """Return the warm-up of finished runs of this study. Raises StudyError if most intact runs are of others."""
        made = [run[1].data.get(MADE_WITH, {}) for _, run in runs if not isinstance(run, FileError)]
        rows = [run[0] for _, run in runs if not isinstance(run, FileError)]
        own = [(row, dict(one)) for row, one in zip(rows, made, strict=True) if wanted.items() <= dict(one).items()]
        if 2 * len(own) <= len(made):
            raise self._of_another(next(dict(one) for one in made if not wanted.items() <= dict(one).items()))
        finished = [one.get(WARM_UP) for row, one in own if row.status == "finished"]
        return finished[0] if finished else None

    def _of_another(self, found: Mapping[str, Any]) -> StudyError:
        other = [what for what, value in origin_of(self._setup).items() if found.get(what) != value]
        fields = ", ".join(self._other_fields())
        named = [f"{what} ({fields})" if what == "study" and fields else what for what in other]
        return StudyError(
            f"{self.folder}: its runs were made with another {' and another '.join(named)}, so they can't be "
            "compared with new ones; expected another folder, or this one emptied to begin anew"
        )

    def _other_fields(self) -> list[str]:
        """Return the study fields that decide a run and differ from those of the stored runs."""
        with suppress(FileError, ValueError, SceneError, StudyError):
            text = read_origin(self.folder).text or read_file(self.folder / SOURCE, MB).decode()
            before = Study.model_validate(parse_overrides(text))
            then, now = deciding(before), deciding(self._setup.study)
            return [name for name, value in now.items() if then[name] != value]
        return []

    def _keep_source(self) -> None:
        """Write the study's text, for people."""
        try:
            if read_file(self.folder / SOURCE, 16 * MB) == self._setup.source.encode():
                return
        except FileError as error:
            self._set_aside(self.folder / SOURCE, str(error))
        self._write(Path(SOURCE), self._setup.source.encode())


def _pilot(job: Job) -> Path:
    return Path(PILOTS) / f"point_{job.point}_seed_{job.seed}.json"


_Runs = list[tuple[Path, "tuple[RunRow, CheckedJson] | FileError"]]


def _runs_in(folder: Path) -> Iterator[tuple[Path, tuple[RunRow, CheckedJson] | FileError]]:
    """Yield the files of runs, each with its content or the reason why it is unusable. Raises OSError."""
    for file in run_files(folder):
        try:
            yield file, read_row(folder, file)
        except FileError as error:
            yield file, error


def read_rows(folder: Path, origin: StudyOrigin | None = None) -> list[RunRow]:
    """Return the finished runs in a folder, in the order of their keys. origin: of the folder; None: it is read.

    Raises StudyError for a folder without a study, and for a run that is damaged or of another study.
    """
    rows = []
    try:
        origin = read_origin(folder) if origin is None else origin
        for file, run in _runs_in(folder):
            problem = str(run) if isinstance(run, FileError) else objection(*run, origin)
            if isinstance(run, FileError) or problem:
                raise StudyError(
                    f"{file}: {problem}, expected an intact run of this study: repeat the command that made "
                    "it, or remove the file to see the other runs"
                )
            rows.append(run[0])
    except OSError as error:
        raise StudyError(f"{folder}: {error.strerror}, expected the folder of a study") from None
    except FileError as error:
        raise unusable(folder / ORIGIN, error) from None
    return sorted(rows, key=lambda row: row.key)


def unusable(file: Path, reason: object) -> StudyError:
    """Return the error for a file about a study that is missing, damaged or of another study."""
    return StudyError(
        f"{file}: {reason}, expected what conveyor-sim sweep or optimise has written; the same command writes it again"
    )

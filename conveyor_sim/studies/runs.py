# SPDX-License-Identifier: Apache-2.0
"""The runs of a study: those in its journal, and an engine that makes the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Protocol, TypeVar

import numpy as np

from conveyor_sim.errors import ConveyorError, StudyError
from conveyor_sim.physics.model import build_model
from conveyor_sim.run.compilation import Compilation
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.simulation import Simulation
from conveyor_sim.statistics.warm_up import warm_up
from conveyor_sim.studies.check import parameter_units, units_of
from conveyor_sim.studies.journal import Journal
from conveyor_sim.studies.line_of import controller_of, scene_of
from conveyor_sim.studies.row import Job, Pilot, RunRow, Status, point_text
from conveyor_sim.studies.run import (
    Work,
    begun,
    failure_of,
    kernels_of,
    load_kernels,
    make_row,
    make_tick,
    reset_counters,
    warm_start,
)
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import MSER
from conveyor_sim.support.worker_pool import DiedError, WorkerPool

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """A context: leaving it by an exception ends at once what is under way."""

    processes: int
    """Runs at a time, as far as it is known."""
    is_here: bool
    """True if all workers are on this machine, with its files."""

    def each(self, function: Callable[[T], R], tasks: Iterable[T]) -> Iterator[tuple[T, R | DiedError]]:
        """Yield each task with the result of `function`, in order of completion."""

    def __enter__(self) -> Engine: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...


PARTS = 200
"""Equal times that a pilot run is cut into; MSER-5 leaves out whole fives of them."""

SEEDS = 10
"""Pilot runs of a point, at most."""


def find_warm_up(
    works: Sequence[Work],
    engine: Engine,
    journal: Journal,
    say: Callable[[str], object],
    progress: Callable[[int, int, float | None, RunRow | None], None],
) -> float:
    """s: that of the point and metric that take longest, one for all runs, so that they stay pairs.

    works: the runs of the first batch; those with the first SEEDS seeds of a point have pilots. They are kept,
    and so is what they find. Raises StudyError where it can't be said.
    """
    by_point: dict[int, list[Work]] = {}
    for work in sorted(works, key=lambda work: work.job.key):
        by_point.setdefault(work.job.point, []).append(work)
    pilots = [work for point in by_point.values() for work in point[:SEEDS]]
    made = {work.job.key: kept for work in pilots if (kept := journal.pilot_of(work.job)) is not None}
    failed: dict[tuple[int, int], str] = {}
    say(f"warm_up: mser: {len(pilots)} pilot runs find it")
    progress(len(made), len(pilots), None, None)
    for work, found in engine.each(pilot, [work for work in pilots if work.job.key not in made]):
        if isinstance(found, Pilot):
            journal.keep_pilot(work.job, found)
            made[work.job.key] = found
        else:
            status, error = ("lost", str(found)) if isinstance(found, DiedError) else found
            if status == "lost":
                raise StudyError(f"warm_up: mser: a pilot run is lost: {error}; the same command makes it again")
            failed[work.job.key] = error
        progress(len(made) + len(failed), len(pilots), None, None)
    if not made:
        raise StudyError(f"warm_up: mser: no pilot run has finished, expected one at least: {failed[min(failed)]}")
    seconds, where = 0.0, ""
    for point in by_point.values():
        seen = [made[work.job.key] for work in point if work.job.key in made]
        for metric in seen[0].series if seen else ():
            what = f"{metric} at {point_text(point[0].job.parameters)}"
            longest = _warm_up(seen, metric, what)
            if longest > seconds:
                seconds, where = longest, f", which {what} takes"
    journal.keep_warm_up(seconds)
    say(f"warm_up: mser: {seconds:g} s{where}, by {len(made)} pilot runs")
    return seconds


def pilot(work: Work) -> Pilot | tuple[Status, str]:
    """Run without a warm-up, with each metric that settles evaluated for each part of the run separately."""
    try:
        return _pilot(work)
    except Exception as error:  # functions and controllers of the study included
        return failure_of(error)


def _pilot(work: Work) -> Pilot:
    setup, job = work.setup, work.job
    setup.require_same_versions()
    scene = scene_of(setup, job.parameters, job.seed)
    controller = controller_of(setup, job.parameters)
    simulation = begun(scene, work.start)
    load_kernels(simulation)
    ticks = scene.duration_ticks - simulation.tick
    if ticks < PARTS:
        raise StudyError(f"runs of {ticks} ticks given, expected {PARTS} at least to see a warm-up in them")
    scans = ScanLoop(simulation, controller)
    watched = {name: metric.series for name, metric in setup.kept.items() if metric.series is not None}
    series: dict[str, list[float]] = {name: [] for name in watched}
    for _ in range(PARTS):
        reset_counters(simulation)
        gauges = {name: make(simulation) for name, make in watched.items()}
        for _ in range(ticks // PARTS):
            make_tick(simulation, scans, None)
            for gauge in gauges.values():
                gauge.after_tick()
        for name, gauge in gauges.items():
            series[name].append(gauge.value())
    return Pilot(ticks // PARTS * scene.tick, series)


def _warm_up(pilots: Sequence[Pilot], metric: str, what: str) -> float:
    """Return the warm-up of a metric at a point, s, from its mean series over the seeds."""
    part = pilots[0].part
    found = warm_up(np.array([made.series[metric] for made in pilots]))
    if found is None:
        raise StudyError(
            f"warm_up: mser: {what} has not settled by the middle of runs of {part * PARTS:g} s, or they are too few "
            "to tell; expected longer runs, more seeds, or a warm_up in seconds"
        )
    return found * part


Progress = Callable[[int, int, float | None, RunRow | None], None]
"""Called with the runs finished, the runs wanted, an estimate of the time left (s; None: nothing to go by), and the run
that has just been finished.
"""


class Runs(AbstractContextManager["Runs"]):
    """Makes runs and keeps them in a folder. A run depends on the study, its parameters and its seed alone.

    Leaving the context by an exception, such as a Ctrl-C, ends what is under way; finished runs are on disk.
    """

    def __init__(
        self, setup: Setup, folder: Path, engine: Engine | None = None, say: Callable[[str], object] = lambda _: None
    ) -> None:
        """Open the runs of a study.

        engine: None: one process per core that this process may use. say: prints progress of long operations.
        Raise StudyError as `Journal`.
        """
        self._setup, self._say = setup, say
        self.folder = folder
        with ExitStack() as stack:
            self.journal = stack.enter_context(Journal(folder, setup, say))
            self._engine = stack.enter_context(WorkerPool() if engine is None else engine)
            self._stack = stack.pop_all()
        if self.journal.warm_up is not None:
            self._setup = setup.with_warm_up(self.journal.warm_up)

    def __exit__(self, *error: object) -> None:
        self._stack.__exit__(*error)  # type: ignore[arg-type]

    def run(self, jobs: Sequence[Job], progress: Progress = lambda *_: None) -> list[RunRow]:
        """Make those that are not there yet; all of them, in the order of the jobs.

        Raises StudyError if one can't be kept. A run that fails is a Row with its error.
        """
        rows = {job.key: row for job in jobs if (row := self.journal.row_of(job)) is not None}
        todo = list({job.key: job for job in jobs if job.key not in rows}.values())
        walls = [row.wall for row in rows.values() if row.status == "finished"]
        spent, counted = sum(walls), len(walls)

        def left() -> float | None:
            return (total - len(rows)) * spent / counted / self._engine.processes if counted else None

        total = len(rows) + len(todo)
        progress(len(rows), total, left(), None)
        if not self.journal.has_units or todo:
            self._compile(todo or jobs[:1])
        unstarted = self._warm(todo)
        for job in [job for job in todo if job.seed in unstarted]:
            rows[job.key] = self._keep(self._unmade(job, *unstarted[job.seed]))
        if self._setup.study.warm_up == MSER and len(rows) < total:
            works = [self._work(job) for job in todo if job.key not in rows]
            found = find_warm_up(works, self._engine, self.journal, self._say, progress)
            self._setup = self._setup.with_warm_up(found)
        works = [self._work(job) for job in todo if job.key not in rows]
        for work, made in self._engine.each(make_row, works):
            job = work.job
            if isinstance(made, DiedError):
                row = self._unmade(job, "lost", str(made))
            else:  # what a worker of another version refuses is a row of that version
                row = self._unmade(job, "lost", made.error) if made.status == "lost" else made
            rows[job.key] = self._keep(row)
            if row.status == "finished":
                spent, counted = spent + row.wall, counted + 1
            progress(len(rows), total, left(), row)
        return [rows[job.key] for job in jobs]

    def _work(self, job: Job) -> Work:
        start: Path | bytes | None = None
        if self._setup.study.warm_start is not None:
            start = self.journal.start_of(job.seed).resolve()
            start = start if self._engine.is_here else start.read_bytes()
        return Work(self._setup, job, start, self.folder.resolve())

    def _unmade(self, job: Job, status: Status, error: str) -> RunRow:
        return RunRow(job.point, job.seed, dict(job.parameters), status, error, asked=self._setup.asked)

    def _keep(self, row: RunRow) -> RunRow:
        self.journal.add(row)
        return row

    def _compile(self, jobs: Sequence[Job]) -> None:
        """Have the kernels in the cache, each kind once, before processes want them at the same time."""
        kinds: set[tuple[str, ...]] = set()
        units = {name: metric.unit or "1" for name, metric in self._setup.kept.items()}
        of_parameters = {name: parameter.unit or "" for name, parameter in self._setup.study.parameters.items()}
        parameters = {tuple(job.parameters.items()): job for job in jobs}
        for job in _different(list(parameters.values())):
            try:
                scene = scene_of(self._setup, job.parameters, job.seed)
                kind = kernels_of(build_model(scene))
                if kind in kinds:
                    continue
                simulation = None if kinds else Simulation(scene, threads=1)
            except Exception:  # the row of the run reports it
                continue
            if simulation is not None:
                units = units_of(self._setup, simulation)
                of_parameters = parameter_units(self._setup, scene)
            try:
                Compilation(scene, self._say).run()
            except Exception:  # the row of the run reports it
                continue
            kinds.add(kind)
        self.journal.keep_units(units, of_parameters)

    def _warm(self, jobs: Sequence[Job]) -> dict[int, tuple[Status, str]]:
        """Have a warm start for each seed; the status of runs without one, and why there is none, by seed."""
        if self._setup.study.warm_start is None:
            return {}
        seeds = {job.seed: replace(job, point=-1, parameters={}) for job in jobs}
        works = [Work(self._setup, job) for seed, job in seeds.items() if not self.journal.has_start(seed)]
        failed: dict[int, tuple[Status, str]] = {}
        for work, made in self._engine.each(_warmed, works):
            if isinstance(made, bytes):
                self.journal.keep_start(work.job.seed, made)
            else:
                failed[work.job.seed] = "lost" if isinstance(made, DiedError) else "failed", f"warm start: {made}"
        return failed


def _warmed(work: Work) -> bytes | str:
    try:
        return warm_start(work)
    except ConveyorError as error:
        return str(error)
    except Exception as error:  # raised by a function of the study
        return f"{type(error).__name__}: {error}"


def _different(jobs: Sequence[Job]) -> list[Job]:
    """Jobs that have every value of every parameter that is no number among them: these may need other kernels."""
    seen: set[tuple[str, object]] = set()
    chosen: list[Job] = []
    for job in jobs:
        values = {(name, value) for name, value in job.parameters.items() if isinstance(value, (str, bool))}
        if not chosen or values - seen:
            seen |= values
            chosen.append(job)
    return chosen

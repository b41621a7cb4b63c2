# SPDX-License-Identifier: Apache-2.0
"""One run of a study, from the scene to its metrics: the same bits wherever it is made."""

from __future__ import annotations

import shutil
import time
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError, ConveyorError, SceneError, StudyError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import ENDED, RUNNING, STOPPED, RunState
from conveyor_sim.physics.model import Model
from conveyor_sim.run.compilation import compile_kernels
from conveyor_sim.run.scan_loop import ScanLoop
from conveyor_sim.scene import Scene, parse_overrides
from conveyor_sim.scene.recorded import sources_of
from conveyor_sim.scene.words import listed
from conveyor_sim.simulation import Simulation
from conveyor_sim.studies.check import gauges_of
from conveyor_sim.studies.gauges import Averaged, half_width
from conveyor_sim.studies.line_of import controller_of, scene_of
from conveyor_sim.studies.row import BAGS, Job, RunRow, Status
from conveyor_sim.studies.setup import Setup
from conveyor_sim.support.printable import SENTENCE, printable

STUDY = "study"
"""Source of its inputs, in a bag's outcomes."""


@dataclass(frozen=True)
class Work:
    """A run, and all that it needs, as it goes to the process that makes it."""

    setup: Setup
    job: Job
    start: Path | bytes | None = field(default=None, repr=False)
    """Checkpoint of the warm start, or its file, in a study with `warm_start`."""
    folder: Path | None = None
    """Folder of the study, for recordings; None: no recordings."""


def make_row(work: Work) -> RunRow:
    """Make a run and return its row; a failure is recorded in the row."""
    job, clock = work.job, _Clock()
    row = RunRow(job.point, job.seed, dict(job.parameters), "failed", asked=work.setup.asked)
    try:
        work.setup.require_same_versions()
    except StudyError as error:  # of this process, not of the run
        return replace(row, status="lost", error=str(error))
    wanted = "none" if work.folder is None else work.setup.study.bags
    place = (work.folder or Path()) / bag_name(job)
    bag = place.parent / f".{uuid.uuid4().hex}" / place.name  # aside until it is whole
    try:
        row = simulate(work, bag if wanted == "all" else None, clock)
    except Exception as error:  # functions and controllers of the study included
        status, said = failure_of(error)
        row = replace(row, status=status, error=said)
    row = replace(row, wall=clock.wall, cpu=clock.cpu)
    if row.status == wanted == "failed":
        with suppress(Exception):  # it fails again, in the same tick
            simulate(work, bag, _Clock())
    if wanted != "none" and bag.is_dir():
        if row.status != "lost":
            shutil.rmtree(place, ignore_errors=True)  # of the same run, with other metrics
            with suppress(OSError):
                bag.rename(place)
                row = replace(row, bag=bag_name(job))
        shutil.rmtree(bag.parent, ignore_errors=True)
    return row


def failure_of(error: Exception) -> tuple[Status, str]:
    """Return the status of a failed run, and a sentence about the exception."""
    lost = isinstance(error, (BagError, MemoryError, OSError))  # of this machine: another time it may be made
    return "lost" if lost else "failed", _sentence(error)


def bag_name(job: Job) -> str:
    """Folder of the recording of a run, below that of its study."""
    return f"{BAGS}/point_{job.point}_seed_{job.seed}"


def warm_start(work: Work) -> bytes:
    """Return a checkpoint at the end of the warm start, for runs with the seed of the job.

    Raise any exception of the run.
    """
    study, job = work.setup.study, work.job
    work.setup.require_same_versions()
    scene = scene_of(work.setup, {}, job.seed)
    simulation = Simulation(scene, threads=1)
    scans = ScanLoop(simulation, controller_of(work.setup, {}))
    for _ in range(round((study.warm_start or 0.0) / scene.tick)):
        make_tick(simulation, scans, None)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "start.npz"
        simulation.save(path)
        return path.read_bytes()


def simulate(work: Work, bag: Path | None, clock: _Clock | None = None) -> RunRow:
    """Simulate one run, recorded to `bag` unless None. Raise any exception of the run, after closing the recording."""
    study, job = work.setup.study, work.job
    scene = scene_of(work.setup, job.parameters, job.seed)
    controller = controller_of(work.setup, job.parameters)
    simulation = begun(scene, work.start)
    gauges_of(work.setup, simulation)  # an unknown name ends the run here, before its warm-up
    with nullcontext() if clock is None else clock.standing():
        load_kernels(simulation)
    keep_start = None if work.start is None else simulation.save
    recorder = None if bag is None else Recorder(bag, start=keep_start, sources=sources_of(scene))
    try:
        outputs = OutputWriter(simulation, [recorder] if recorder else [], run_id=uuid.uuid4().hex)
        if work.start is not None:
            simulation.take_events()  # of the warm start
        outputs.start()
        outputs.show_run(RunState(RUNNING))
        scans = ScanLoop(simulation, controller)
        if isinstance(study.warm_up, str):
            raise StudyError(f"warm_up: {study.warm_up} given, expected seconds, as pilot runs have found them")
        first, last = simulation.tick, scene.duration_ticks
        measured = first + round(study.warm_up / scene.tick)
        if measured >= last:
            raise StudyError(f"warm_up: {study.warm_up:g} s given, expected less than a run takes")
        try:
            while simulation.tick < measured:
                make_tick(simulation, scans, outputs)
            if simulation.tick:
                reset_counters(simulation)
            gauges = gauges_of(work.setup, simulation)
            while simulation.tick < last:
                make_tick(simulation, scans, outputs)
                for gauge in gauges.values():
                    gauge.after_tick()
        except Exception as error:
            outputs.after_failure()
            outputs.show_run(RunState(STOPPED, printable(error, SENTENCE)))
            raise
        outputs.show_run(RunState(ENDED))
    finally:
        if recorder is not None:
            recorder.close()
    return RunRow(
        job.point,
        job.seed,
        dict(job.parameters),
        "finished",
        metrics={name: float(gauge.value()) for name, gauge in gauges.items()},
        asked=work.setup.asked,
        half_widths={name: half_width(gauge) for name, gauge in gauges.items() if isinstance(gauge, Averaged)},
        simulated=(last - first) * scene.tick,
        dt=simulation.model.dt,
    )


def begun(scene: Scene, start: Path | bytes | None) -> Simulation:
    """Return a simulation at the start of a run, or at the end of its warm start."""
    if start is None:
        return Simulation(scene, threads=1)
    if isinstance(start, Path):
        return Simulation.load(start, threads=1, scene=scene)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "start.npz"
        path.write_bytes(start)
        return Simulation.load(path, threads=1, scene=scene)


def make_tick(simulation: Simulation, scans: ScanLoop, outputs: OutputWriter | None) -> None:
    """Make one tick of a run, with a scan of its controller."""
    scans.before_tick(outputs)
    simulation.advance(1)
    scans.after_tick(simulation.take_outcomes() if outputs is None else outputs.after_tick())


def reset_counters(simulation: Simulation) -> None:
    """Have all counters of a line begin anew with the next tick."""
    if simulation.line.counters() is not None:
        simulation.give(Input(STUDY, STUDY, "test", "reset_counters", (), ()))


_LOADED: set[tuple[str, ...]] = set()


def kernels_of(model: Model) -> tuple[str, ...]:
    """Models with the same answer need, as a rule, the same kernels."""
    return (model.integrator, *(choice.name for choice in model.effects if choice.on))


def load_kernels(simulation: Simulation) -> None:
    """Have them in this process."""
    kind = kernels_of(simulation.model)
    if kind not in _LOADED:
        compile_kernels(simulation.scene)
        _LOADED.add(kind)


class _Clock:
    """Wall and processor time of a run in this thread, without what is done while it stands."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.thread_time()

    @property
    def wall(self) -> float:
        """Return the wall time, s."""
        return time.perf_counter() - self._wall

    @property
    def cpu(self) -> float:
        """Return the processor time, s."""
        return time.thread_time() - self._cpu

    @contextmanager
    def standing(self) -> Iterator[None]:
        """Compiling and loading kernels is no part of a run."""
        wall, cpu = self.wall, self.cpu
        yield
        self._wall, self._cpu = time.perf_counter() - wall, time.thread_time() - cpu


def _sentence(error: BaseException) -> str:
    kind = "" if isinstance(error, ConveyorError) else f"{type(error).__name__}: "
    return printable(" ".join(f"{kind}{error}".split()) or kind, SENTENCE)


def job_of(setup: Setup, texts: Sequence[str], seed: int) -> Job:
    """Return one run of a study. texts: "name=value" for each parameter, as YAML.

    Raise StudyError unless they name the study's parameters.
    """
    values: dict[str, Any] = {}
    wanted = list(setup.study.parameters)
    for text in texts:
        name, sign, value = text.partition("=")
        if not sign or name not in wanted:
            raise StudyError(f"--set {text}: given, expected name=value of {listed(wanted)}")
        try:
            values[name] = parse_overrides(f"value: {value}")["value"]
        except SceneError:
            raise StudyError(f"--set {text}: given, expected a number, a text, true or false as its value") from None
    missing = [name for name in wanted if name not in values]
    if missing:
        raise StudyError(f"--set: {listed(missing)} missing, expected a value for each parameter")
    return Job(0, {name: values[name] for name in wanted}, seed)


def run_alone(setup: Setup, job: Job, bag: Path | None) -> RunRow:
    """Repeat one run of a study, with the same bits, in this process.

    bag: folder to record to. Raise any exception of the run.
    """
    start = None if setup.study.warm_start is None else warm_start(Work(setup, job))
    return simulate(Work(setup, job, start), bag)

"""Many long runs, by setting and seed, over local processes; each is on disk as soon as it is finished."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import fmean

from conveyor_sim.accuracy.jitter import disturb, jittered
from conveyor_sim.accuracy.observables import measuring, observe
from conveyor_sim.accuracy.results import Sample
from conveyor_sim.accuracy.sample_file import SampleFile
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.simulation import Simulation

Run = tuple[Setting, int]
"""A setting and a seed."""

Progress = Callable[[int, int, float | None], None]
"""Called with the runs finished, the runs wanted, and an estimate of the time left (s; None: nothing to go by)."""

DIED = "the process that ran it ended without a word, twice: killed, or out of memory"


@dataclass(frozen=True)
class _Work:
    """A scene and a setting, as texts and numbers that travel to another process."""

    text: str
    name: str
    overrides: str
    setting: Setting

    def scene(self, seed: int) -> Scene:
        """The scene to run. Raises SceneError if it can't be simulated so."""
        scene = parse_scene(self.text, self.name, parse_overrides(self.overrides))
        return with_setting(scene, self.setting, **measuring(scene), **jittered(scene, seed))


class Ensemble(AbstractContextManager["Ensemble"]):
    """The runs of one scene, kept in a folder, and the processes that make more of them.

    A run depends on the scene, its setting and its seed alone, never on which process made it. Leaving the context by
    an exception, such as a Ctrl-C, or ending this process in any way ends the others at once, in the middle of what
    they are at; finished runs are on disk. The processes are spawned: a program that is a file needs its
    `if __name__ == "__main__"`.
    """

    def __init__(self, scene: Scene, folder: Path, processes: int | None = None) -> None:
        """processes: None is one for each core that this process may use, and no more than that are used.

        Raises ConveyorError if the folder has runs of another scene or version (`SampleFile`).
        """
        cores = len(os.sched_getaffinity(0))
        self.processes = cores if processes is None else max(1, min(processes, cores))
        self._scene = scene
        self._file = SampleFile(folder, scene)
        self._samples = {(sample.setting, sample.seed): sample for sample in self._file.found}
        self.spent = 0.0
        """s of processor time of all runs that were asked for, those that were there already included."""
        self._pool: ProcessPoolExecutor | None = None
        self._lifeline: tuple[Connection, Connection] | None = None

    def run(self, wanted: Sequence[Run], progress: Progress) -> list[Sample]:
        """Make the wanted runs that are not there yet; all of them, in the order wanted.

        A run that fails, or whose process dies twice, is a Sample with its `failure`.
        """
        wanted = list(dict.fromkeys(wanted))
        todo = deque(run for run in wanted if run not in self._samples)
        self._compile(todo)
        pending: dict[Future[Sample], Run] = {}
        while todo or pending:
            self._tell(wanted, progress)
            while todo and len(pending) < self.processes:
                try:
                    pending[self._workers().submit(_run, self._work(todo[0][0]), todo[0][1])] = todo[0]
                    todo.popleft()
                except BrokenProcessPool:
                    if pending:
                        break  # they will tell
                    self._close_pool(at_once=True)
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            if any(isinstance(future.exception(), BrokenProcessPool) for future in finished):
                finished, _ = wait(pending)  # one process that dies takes the runs of all others with it
                suspects = [pending[future] for future in finished if future.exception() is not None]
                self._close_pool(at_once=True)
            else:
                suspects = []
            for future in finished:
                run = pending.pop(future)
                if run not in suspects:
                    self._keep(future.result())
            for run in suspects:
                self._keep(self._alone(run))
        self._tell(wanted, progress)
        return [self._samples[run] for run in wanted]

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._close_pool(at_once=kind is not None)
        self._file.close()

    def _compile(self, todo: Sequence[Run]) -> None:
        """Fill the cache on disk, each kernel once: stiffness and steps are numbers to it."""
        settings = {setting.integrator: setting for setting, _ in todo}
        compiled = [self._workers().submit(_rehearse, self._work(setting)) for setting in settings.values()]
        if any(isinstance(future.exception(), BrokenProcessPool) for future in compiled):
            self._close_pool(at_once=True)

    def _alone(self, run: Run) -> Sample:
        """A run whose process, or another beside it, has died: once more by itself, to find out."""
        try:
            return self._workers().submit(_run, self._work(run[0]), run[1]).result()
        except BrokenProcessPool:
            self._close_pool(at_once=True)
            return Sample(*run, values={}, cpu=0.0, failure=DIED)

    def _work(self, setting: Setting) -> _Work:
        return _Work(self._scene.source_text, self._scene.source_name, self._scene.overrides_text, setting)

    def _keep(self, sample: Sample) -> None:
        self._file.append(sample)
        self._samples[sample.setting, sample.seed] = sample

    def _tell(self, wanted: Sequence[Run], progress: Progress) -> None:
        finished = [self._samples[run] for run in wanted if run in self._samples]
        self.spent = sum(sample.cpu for sample in finished)
        per_step = [sample.cpu / sample.setting.per_tick for sample in finished]
        costs: dict[Setting, list[float]] = {}
        for sample in finished:
            costs.setdefault(sample.setting, []).append(sample.cpu)
        left = 0.0
        for setting, _ in (run for run in wanted if run not in self._samples):
            known = costs.get(setting)
            left += fmean(known) if known else fmean(per_step) * setting.per_tick if per_step else 0.0
        progress(len(finished), len(wanted), left / self.processes if finished else None)

    def _workers(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = get_context("spawn")
            self._lifeline = context.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(self.processes, context, _begin, (self._lifeline[0],))
        return self._pool

    def _close_pool(self, at_once: bool) -> None:
        if self._pool is None or self._lifeline is None:
            return
        if at_once:
            self._lifeline[1].close()
        self._pool.shutdown(cancel_futures=True)
        for end in self._lifeline:
            end.close()
        self._pool = self._lifeline = None


def _begin(lifeline: Connection) -> None:
    """Start of a process: Ctrl-C is its parent's affair, and it ends with its parent, or when asked to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    """Wait until the other end, which only the parent holds, is closed, by the parent or by its death."""
    lifeline.poll(None)
    os._exit(1)


@cache
def _rehearse(work: _Work) -> None:
    """Have numba compile or load what a setting needs, in this process; what can't be is reported by its runs."""
    try:
        simulation = Simulation(work.scene(0), threads=1, shorten=False)
        simulation.advance()
    except ConveyorError:
        return
    simulation.bottles()
    simulation.contacts()


def _run(work: _Work, seed: int) -> Sample:
    """One long run; its processor time is without compiling."""
    _rehearse(work)
    began = time.process_time()
    values: dict[str, float] = {}
    failure = ""
    try:
        simulation = Simulation(work.scene(seed), threads=1, shorten=False)
        disturb(simulation, seed)
        values = observe(simulation)
    except ConveyorError as error:
        failure = " ".join(str(error).split())
    return Sample(work.setting, seed, values, time.process_time() - began, failure)

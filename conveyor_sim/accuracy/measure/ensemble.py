# SPDX-License-Identifier: Apache-2.0
"""Many long runs, by setting and seed, over local processes; each is on disk as soon as it is finished."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from conveyor_sim.accuracy.measure.jitter import disturb, jittered
from conveyor_sim.accuracy.measure.observables import measuring, observe
from conveyor_sim.accuracy.measure.sample_file import SampleFile
from conveyor_sim.accuracy.results import Sample
from conveyor_sim.accuracy.setting import Setting, with_setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.worker_pool import DIED, DiedError, WorkerPool, free_cores

Run = tuple[Setting, int]
"""A setting and a seed."""

Progress = Callable[[int, int, float], None]
"""Called with the runs finished, the runs wanted, and the processor time of the finished runs, s."""


@dataclass(frozen=True)
class _Work:
    """A scene, a setting and a seed, as texts and numbers that travel to another process."""

    text: str
    name: str
    overrides: str
    setting: Setting
    seed: int

    def scene(self) -> Scene:
        """Build the scene of the run. Raise SceneError if it can't be simulated with this setting."""
        scene = parse_again(self.text, self.name, parse_overrides(self.overrides))
        return with_setting(scene, self.setting, **measuring(scene), **jittered(scene, self.seed))


class Ensemble(AbstractContextManager["Ensemble"]):
    """The runs of one scene, kept in a folder, and the processes that make more of them.

    A run depends on the scene, its setting and its seed alone, never on which process made it. Leaving the context by
    an exception, such as a Ctrl-C, or ending this process in any way ends the others at once, in the middle of what
    they are at; finished runs are on disk. The processes are spawned: a program that is a file needs its
    `if __name__ == "__main__"`.
    """

    def __init__(self, scene: Scene, folder: Path, processes: int | None = None) -> None:
        """Open an ensemble. processes: None: one per core that this process may use, which is also the maximum.

        Raise ConveyorError if the folder has runs of another scene or version (`SampleFile`).
        """
        cores = free_cores()
        self.processes = cores if processes is None else max(1, min(processes, cores))
        self._scene = scene
        self._file = SampleFile(folder, scene)
        self._samples = {(sample.setting, sample.seed): sample for sample in self._file.found}
        self._pool = WorkerPool(self.processes)

    def run(self, wanted: Sequence[Run], progress: Progress) -> list[Sample]:
        """Make the wanted runs that are not there yet; all of them, in the order wanted.

        A run that fails, or whose process dies twice, is a Sample with its `failure`.
        """
        wanted = list(dict.fromkeys(wanted))
        todo = [run for run in wanted if run not in self._samples]
        self._tell(wanted, progress)
        self._compile(todo)
        for work, made in self._pool.each(_run, [self._work(*run) for run in todo]):
            died = Sample(work.setting, work.seed, values={}, cpu=0.0, failure=DIED)
            self._keep(died if isinstance(made, DiedError) else made)
            self._tell(wanted, progress)
        return [self._samples[run] for run in wanted]

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._pool.__exit__(kind)
        self._file.close()

    def _compile(self, todo: Sequence[Run]) -> None:
        """Fill the cache on disk, each kernel once: stiffness and steps are numbers to it."""
        settings = {setting.integrator: setting for setting, _ in todo}
        for _ in self._pool.each(_rehearse, [self._work(setting, 0) for setting in settings.values()]):
            pass  # one that can't be compiled is reported by its runs

    def _work(self, setting: Setting, seed: int) -> _Work:
        return _Work(self._scene.source_text, self._scene.source_name, self._scene.overrides_text, setting, seed)

    def _keep(self, sample: Sample) -> None:
        self._file.append(sample)
        self._samples[sample.setting, sample.seed] = sample

    def _tell(self, wanted: Sequence[Run], progress: Progress) -> None:
        finished = [self._samples[run] for run in wanted if run in self._samples]
        progress(len(finished), len(wanted), sum(sample.cpu for sample in finished))


@cache
def _rehearse(work: _Work) -> None:
    """Have numba compile or load what a setting needs, in this process; what can't be is reported by its runs."""
    try:
        simulation = Simulation(work.scene(), threads=1, shorten=False)
        simulation.advance()
    except ConveyorError:
        return
    simulation.bottles()
    simulation.contacts()


def _run(work: _Work) -> Sample:
    """One long run; its processor time is without compiling."""
    _rehearse(replace(work, seed=0))
    began = time.process_time()
    values: dict[str, float] = {}
    failure = ""
    try:
        simulation = Simulation(work.scene(), threads=1, shorten=False)
        disturb(simulation, work.seed)
        values = observe(simulation)
    except ConveyorError as error:
        failure = " ".join(str(error).split())
    return Sample(work.setting, work.seed, values, time.process_time() - began, failure)

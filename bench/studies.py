# SPDX-License-Identifier: Apache-2.0
"""Runs of a study by several processes, against one; and what comes beside the simulation of a run."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.simulation import Simulation
from conveyor_sim.studies.line_of import scene_of
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.row import Job
from conveyor_sim.studies.runs import Engine, Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.support.worker_pool import WorkerPool

SCALING, BESIDE = "studies", "beside the simulation"
RATE, OVERHEAD = "runs a minute", "ms a run beside the simulation"
ONE, TWO, FOUR, DASK = "1 process", "2 processes", "4 processes", "Dask, 4 workers over loopback"
STUDY = Path(__file__).parent.parent / "examples" / "studies" / "table_length.yaml"
POINT = {"length": 1.0}
LONG, SHORT = 60.0, 0.5
"""s, simulated, of runs that are compared, and of those of which the rest is looked at."""
RUNS, QUICK_RUNS = 24, 4
FIRST = 1_000_000
"""Seeds of runs that are not counted: processes start, and load kernels, in them."""


def measure(effort: Effort) -> list[Row]:
    """In turns; each with processes of its own, which have made a run before the clock starts."""
    engines: dict[str, Callable[[], Engine]] = {
        ONE: partial(WorkerPool, 1),
        TWO: partial(WorkerPool, 2),
        FOUR: partial(WorkerPool, 4),
    }
    if find_spec("distributed") is not None:
        from conveyor_sim.studies.dask_engine import DaskEngine

        engines[DASK] = partial(DaskEngine, "local", 4, say)
    runs = QUICK_RUNS if effort.quick else RUNS
    long, short = _study(LONG / (10.0 if effort.quick else 1.0)), _study(SHORT)
    rows = []
    for turn in range(1 if effort.quick else effort.rounds):
        for name, engine in engines.items():
            say(f"studies, {name}, round {turn + 1}")
            with _ready(long, engine()) as made:
                rows.append(Row(SCALING, 0.0, name, RATE, turn, 60.0 * runs / _wall(made, runs)))
        say(f"studies, beside the simulation, round {turn + 1}")
        with _ready(short, WorkerPool(1)) as made:
            whole = _wall(made, 4 * runs)
        rows.append(Row(BESIDE, 0.0, ONE, OVERHEAD, turn, 1e3 * (whole - _simulated(short, 4 * runs)) / (4 * runs)))
    return rows


def _study(duration: float) -> Setup:
    setup = load_study(STUDY)
    changes = {"duration": duration, "warm_up": 0.0}
    return Setup(**{**setup.__getstate__(), "study": setup.study.model_copy(update=changes)})


@contextmanager
def _ready(setup: Setup, engine: Engine) -> Iterator[Runs]:
    """Yield runs by an engine whose processes have each completed some."""
    with tempfile.TemporaryDirectory() as folder, Runs(setup, Path(folder), engine, say) as made:
        made.run([Job(0, POINT, FIRST + number) for number in range(4 * engine.processes)])
        yield made


def _wall(made: Runs, runs: int) -> float:
    """s, for so many."""
    began = time.perf_counter()
    rows = made.run([Job(0, POINT, seed) for seed in range(runs)])
    took = time.perf_counter() - began
    if any(row.status != "finished" for row in rows):
        raise RuntimeError(f"runs have not finished: {rows}")
    return took


def _simulated(setup: Setup, runs: int) -> float:
    """s, to build the same lines and advance them, and nothing else."""
    took = 0.0
    for seed in range(FIRST, FIRST + runs + 1):
        scene = scene_of(setup, POINT, seed % FIRST)
        began = time.perf_counter()
        Simulation(scene, threads=1).advance(scene.duration_ticks)
        if seed > FIRST:  # the first one loads kernels
            took += time.perf_counter() - began
    return took


def tables(rows: Rows) -> str:
    """Two tables."""
    scaling = [
        [name, rows.spread(SCALING, 0.0, name, RATE), rows.ratio(SCALING, 0.0, name, ONE, RATE)]
        for name in rows.contestants(SCALING)
    ]
    beside = [[OVERHEAD, rows.spread(BESIDE, 0.0, ONE, OVERHEAD)]]
    return "\n\n".join(
        [
            markdown([f"Two machines, runs of {LONG:g} s", RATE, f"times {ONE}"], scaling),
            markdown([f"Runs of {SHORT:g} s, {ONE}", ""], beside),
        ]
    )

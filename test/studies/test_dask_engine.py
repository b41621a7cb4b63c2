# SPDX-License-Identifier: Apache-2.0
"""Dask as the engine: a real scheduler and real workers, killed and started again while a study runs."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from facts import stating
from studies.small import Here, setup_of
from studies.test_warm_up import FILLING
from studies.waiting import until
from warm import Warm

pytest.importorskip("distributed")

from conveyor_sim.errors import StudyError
from conveyor_sim.studies import dask_engine
from conveyor_sim.studies.dask_engine import DaskEngine
from conveyor_sim.studies.results import read_results
from conveyor_sim.studies.row import Job, RunRow
from conveyor_sim.studies.run import run_alone
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """More of it, for machines that are slow."""
    monkeypatch.setattr(dask_engine, "PATIENCE", 280.0)


RATES = {"rate": {"argument": "rate", "values": [4.0, 5.0, 6.0]}}


class Cluster:
    """A scheduler and workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self._folder, self.port = folder, 0
        self._processes: dict[int, Warm] = {}

    def scheduler(self) -> str:
        """Start one, at the port of the one before; its address."""
        file = self._folder / f"scheduler_{len(self._processes)}.json"
        where = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--scheduler-file", str(file)]
        process = self._start("scheduler", ["scheduler", *where])

        def address() -> str:
            nonlocal process
            if process.poll() is not None:  # somebody has taken the port for a moment
                process = self._start("scheduler", ["scheduler", *where])
            try:
                return str(json.loads(file.read_text())["address"])
            except (OSError, ValueError):
                return ""

        found = until(address, "a scheduler")
        self.port = int(found.rpartition(":")[2])
        return found

    def worker(self, address: str) -> None:
        """Start one more."""
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        self._start("worker", ["worker", address, *options, "--local-directory", str(self._folder)])

    def kill(self) -> None:
        """All of it, without a word."""
        for process in self._processes.values():
            process.kill()
        for process in self._processes.values():
            process.wait()

    def _start(self, what: str, arguments: list[str]) -> Warm:
        log = (self._folder / f"{what}_{len(self._processes)}.log").open("w")
        with log:
            process = Warm(["-m", "dask", *arguments], log, log)
        self._processes[process.pid] = process
        return process


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[Cluster, str]]:
    """Start a cluster with `workers` workers."""
    made = Cluster(folder)
    try:
        address = made.scheduler()
        for _ in range(workers):
            made.worker(address)
        yield made, address
    finally:
        made.kill()


def gated(folder: Path) -> Setup:
    """A study whose runs wait until a file `go` is there, and say that they run; but those of the first point."""
    (folder / "main").write_text(str(os.getpid()))
    return setup_of(folder, function="code.py:gated", arguments={"folder": str(folder)}, parameters=RATES, duration=1.0)


def running(folder: Path) -> set[int]:
    """Processes that are in the middle of a run."""
    return {int(path.name.partition("_")[2]) for path in folder.glob("running_*")}


@contextmanager
def swept(setup: Setup, folder: Path, address: str) -> Iterator[list[RunRow]]:
    """A study under way in a thread; its rows are there as the context ends."""
    rows: list[RunRow] = []
    failed: list[BaseException] = []

    def work() -> None:
        try:
            with Runs(setup, folder, DaskEngine(address, None, lambda _: None)) as runs:
                rows.extend(sweep(runs, setup))
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=work, daemon=True)  # not waited for where the test fails
    thread.start()
    yield rows
    thread.join()
    if failed:
        raise failed[0]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, float]]:
    """Return the metrics of the runs, made in this process."""
    setup = setup_of(tmp_path_factory.mktemp("expected"), parameters=RATES, duration=1.0)
    jobs = [Job(point, {"rate": rate}, seed) for point, rate in enumerate((4.0, 5.0, 6.0)) for seed in (1, 2)]
    return [dict(run_alone(setup, job, None).metrics) for job in jobs]


def test_a_worker_that_is_killed_in_the_middle_of_a_run(tmp_path: Path, expected: list[dict[str, float]]) -> None:
    setup = gated(tmp_path)
    with cluster(tmp_path, 2) as (_, address), swept(setup, tmp_path / "out", address) as rows:
        pid = min(until(lambda: running(tmp_path), "a run under way"))
        os.kill(pid, signal.SIGKILL)
        (tmp_path / "go").touch()
    assert [row.status for row in rows] == ["finished"] * 6, [row.error for row in rows]
    assert [dict(row.metrics) for row in rows] == expected


def test_a_scheduler_that_is_started_again(tmp_path: Path, expected: list[dict[str, float]]) -> None:
    setup = gated(tmp_path)
    with Runs(setup, tmp_path / "out", Here()) as runs:
        kept = runs.run([Job(0, {"rate": 4.0}, 1)])
    with cluster(tmp_path, 1) as (made, address), swept(setup, tmp_path / "out", address) as rows:
        until(lambda: running(tmp_path), "a run under way")
        made.kill()
        (tmp_path / "go").touch()
        made.worker(made.scheduler())
    assert [dict(row.metrics) for row in rows] == expected
    assert rows[:1] == kept


def test_a_scheduler_that_stays_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_engine, "PATIENCE", 0.5)
    with pytest.raises(StudyError, match=stating("Dask", "scheduler", "workers", "0 s", "same command")):
        DaskEngine("tcp://127.0.0.1:1", None, lambda _: None)


def test_workers_of_this_machine(tmp_path: Path, expected: list[dict[str, float]]) -> None:
    setup = setup_of(tmp_path, parameters=RATES, duration=1.0)
    with Runs(setup, tmp_path / "out", DaskEngine("local", 2, lambda _: None)) as runs:
        assert [dict(row.metrics) for row in sweep(runs, setup)] == expected


def test_the_warm_up_that_they_find_is_the_same(tmp_path: Path) -> None:
    setup = setup_of(tmp_path, **FILLING)
    with Runs(setup, tmp_path / "here", Here()) as runs:
        here = sweep(runs, setup)
    with Runs(setup, tmp_path / "there", DaskEngine("local", 2, lambda _: None)) as runs:
        there = sweep(runs, setup)
    assert [row.metrics for row in there] == [row.metrics for row in here]
    assert read_results(tmp_path / "there").warm_up == read_results(tmp_path / "here").warm_up

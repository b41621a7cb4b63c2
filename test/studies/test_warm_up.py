# SPDX-License-Identifier: Apache-2.0
"""`warm_up: mser`: pilot runs find how long a line takes to fill, equally with any engine and number of tries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing, stating
from studies.small import Here, setup_of

from conveyor_sim.cli import main
from conveyor_sim.errors import StudyError
from conveyor_sim.studies.results import read_results, write_parquet
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.run import job_of, run_alone
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep

FILLING: dict[str, Any] = {
    "warm_up": "mser",
    "duration": 40.0,
    "overrides": {"belts": {"conveyor": {"speed": 0.1}}, "tick": 0.02},
    "metrics": ["throughput", {"queue": "mean belts/conveyor/bottles"}, "stops"],
}
"""A line that begins empty: the belt takes 6.2 s to the sink, and is full from then on."""

Made = tuple[Setup, Path, list[RunRow], list[str]]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """The study, and what was said."""
    folder = tmp_path_factory.mktemp("filling")
    setup, said = setup_of(folder, **FILLING), list[str]()
    with Runs(setup, folder / "out", Here(), said.append) as runs:
        return setup, folder / "out", sweep(runs, setup), said


def test_the_time_that_a_line_takes_to_fill_is_found(made: Made) -> None:
    setup, folder, rows, said = made
    found = read_results(folder).warm_up
    assert found is not None and 5.0 <= found <= 8.0
    assert said[-1].startswith(f"warm_up: mser: {found:g} s, which ")
    assert [row.status for row in rows] == ["finished"] * 4
    biased = run_alone(setup.with_warm_up(0.0), job_of(setup, ["rate=6.0"], 1), None)
    steady = next(row for row in rows if row.parameters["rate"] == 6.0)
    # From a full belt bottles come at 6 cm, its pace, all the time; from an empty one for 34 s of 40.
    assert steady.metrics["throughput"] == pytest.approx(60.0 * 0.1 / 0.06, rel=0.03)
    assert biased.metrics["throughput"] == pytest.approx(60.0 * 0.1 / 0.06 * 34.0 / 40.0, rel=0.05)


def test_it_is_in_the_files_and_in_the_command_of_each_run(made: Made, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    setup, folder, rows, _ = made
    results = read_results(folder)
    assert json.loads((folder / "study.json").read_text())["warm_up"] == results.warm_up
    path = write_parquet(results, tmp_path / "results.parquet")
    assert json.loads(parquet.read_schema(path).metadata[b"conveyor_sim"])["warm_up"] == results.warm_up
    again = read_results(path)
    assert again.warm_up == results.warm_up
    assert again.command(rows[0]).endswith(f"--set rate=4.0 --seed 1 --warm-up {results.warm_up!r}")
    alone = run_alone(setup.with_warm_up(results.warm_up or 0.0), job_of(setup, ["rate=4.0"], 1), None)
    assert alone.metrics == rows[0].metrics
    with pytest.raises(StudyError, match=stating("warm_up", "mser", "seconds")):
        run_alone(setup, job_of(setup, ["rate=4.0"], 1), None)
    command = again.command(rows[0]).split()[1:]
    called = CliRunner().invoke(main, command)
    assert called.output.splitlines() == [f"{name}: {value!r}" for name, value in rows[0].metrics.items()]
    called = CliRunner().invoke(main, command[:-2])
    assert missing(called.output, ["--warm-up", "missing", "seconds"]) == []


@pytest.mark.parametrize("stop_after", [2, 5])
def test_it_is_the_same_from_where_it_was_interrupted(made: Made, tmp_path: Path, stop_after: int) -> None:
    """In the pilot runs, of which there are four, and behind them; with an engine that turns their order round."""
    _, _, rows, said = made
    setup, finished = setup_of(tmp_path, **FILLING), 0

    def stop(done: int, _total: int, _left: float | None, row: RunRow | None) -> None:
        nonlocal finished
        finished += done > 0
        if finished == stop_after:
            raise KeyboardInterrupt

    first, second = Here(backwards=True), Here(backwards=True)
    with pytest.raises(KeyboardInterrupt), Runs(setup, tmp_path / "out", first) as runs:
        sweep(runs, setup, stop)
    again: list[str] = []
    with Runs(setup, tmp_path / "out", second, again.append) as runs:
        assert [row.metrics for row in sweep(runs, setup)] == [row.metrics for row in rows]
    assert first.made + second.made == 8, "four pilots and four runs, none of them twice"
    assert (again[-1:] == said[-1:]) == (stop_after < 4), "what was kept is not looked for again"
    assert read_results(tmp_path / "out").warm_up == read_results(made[1]).warm_up


def test_later_runs_have_the_warm_up_of_the_first_ones(made: Made) -> None:
    """More seeds and other metrics are no other study."""
    _, folder, rows, _ = made
    more = setup_of(folder.parent, **{**FILLING, "seeds": 3, "metrics": [*FILLING["metrics"], "failures"]})
    with Runs(more, folder, engine := Here()) as runs:
        found = sweep(runs, more)
    assert engine.made == 6 and found[0].metrics.items() >= rows[0].metrics.items()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"duration": 1.0},
            "warm_up: mser: no pilot run has finished, .*: runs of 50 ticks given, expected 200 at least",
        ),
        (
            {"duration": 8.0},
            "warm_up: mser: queue at rate 4 has not settled by the middle of runs of 8 s, .*longer runs",
        ),
        (
            {"metrics": [{"made": "mean machines/first/produced"}], "duration": 10.0},
            "made at rate 4 has not settled by the middle",
        ),
    ],
)
def test_runs_that_are_too_short_for_it_are_refused(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    setup = setup_of(tmp_path, **{**FILLING, **changes})
    with pytest.raises(StudyError, match=said), Runs(setup, tmp_path / "out", Here()) as runs:
        sweep(runs, setup)
    assert not list((tmp_path / "out" / "runs").iterdir())

# SPDX-License-Identifier: Apache-2.0
"""A study from its file to its table: equal bits from any engine, in any order of completion."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing, stating
from studies.small import CODE, Here, setup_of, write_study

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.cli import main
from conveyor_sim.errors import StudyError
from conveyor_sim.studies.journal import read_rows
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.results import read_results, run_command, write_parquet
from conveyor_sim.studies.row import Job, RunRow
from conveyor_sim.studies.run import Work, job_of, make_row, run_alone, warm_start
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep
from conveyor_sim.studies.table import points_table
from conveyor_sim.studies.verdict import verdicts

METRICS = [
    "efficiency",
    "throughput",
    "stops",
    {"made": "throughput machines/first"},
    {"queue": "mean belts/conveyor/bottles"},
    {"most": "maximum belts/conveyor/bottles"},
    {"fed": "change machines/first/produced"},
    {"high": "quantile 0.9 belts/conveyor/bottles"},
    {"mine": "code.py:fed"},
    {"busiest": "code.py:Busiest"},
]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Setup, Path, list[RunRow]]:
    """A study that two processes have made."""
    folder = tmp_path_factory.mktemp("study")
    setup = setup_of(folder, metrics=METRICS, warm_up=0.4, duration=2.0, seeds=3)
    told: list[tuple[int, int]] = []
    with Runs(setup, folder / "out") as runs:
        rows = sweep(runs, setup, lambda done, total, left, row: told.append((done, total)))
    assert told == [(done, 6) for done in range(7)]
    return setup, folder / "out", rows


def test_there_is_a_row_for_each_point_and_seed(made: tuple[Setup, Path, list[RunRow]]) -> None:
    _, folder, rows = made
    assert [(row.point, row.seed, row.parameters["rate"]) for row in rows] == [
        (point, seed, rate) for point, rate in enumerate((4.0, 6.0)) for seed in (1, 2, 3)
    ]
    assert [row.status for row in rows] == ["finished"] * 6, [row.error for row in rows]
    assert rows == read_rows(folder)
    for row in rows:
        found = row.metrics
        assert row.simulated == 2.0 and row.cpu > 0.0 and 0.0 < row.dt < 0.01
        assert found["made"] == pytest.approx(found["fed"] / (1.6 / 60.0))
        assert 0.0 < found["queue"] <= found["high"] <= found["most"] <= found["busiest"] == found["most"]
        assert found["fed"] <= found["mine"] and found["stops"] >= 1.0


def test_the_engine_and_the_order_change_no_bit(made: tuple[Setup, Path, list[RunRow]], tmp_path: Path) -> None:
    setup, _, rows = made
    with Runs(setup, tmp_path, Here(backwards=True)) as runs:
        again = sweep(runs, setup)
    assert [(row.key, row.metrics) for row in again] == [(row.key, row.metrics) for row in rows]


def test_a_run_is_made_again_by_its_command(made: tuple[Setup, Path, list[RunRow]], tmp_path: Path) -> None:
    setup, _, rows = made
    command = run_command(setup.path, rows[4])
    assert command == f"conveyor-sim sweep {setup.path} --set rate=6.0 --seed 2"
    again = run_alone(setup, job_of(setup, ["rate=6.0"], 2), tmp_path / "bag")
    assert again.metrics == rows[4].metrics
    with open_bag(tmp_path / "bag") as bag:
        assert bag.counts["counters"] > 0
    for given in (["rate"], ["speed=1"], [], ["rate=[1"]):
        with pytest.raises(StudyError, match="--set"):
            job_of(setup, given, 2)


def test_finished_runs_are_not_made_again(made: tuple[Setup, Path, list[RunRow]]) -> None:
    setup, folder, rows = made
    engine = Here()
    with Runs(setup, folder, engine) as runs:
        assert sweep(runs, setup) == rows
        assert engine.made == 0
        more = [Job(5, {"rate": 5.0}, 1), Job(0, {"rate": 4.0}, 1)]
        found = runs.run(more)
        assert engine.made == 1 and found[1] == rows[0] and found[0].parameters == {"rate": 5.0}
        with pytest.raises(StudyError, match=stating("point 0", "{'rate': 4.0}", "{'rate': 9.0}")):
            runs.run([Job(0, {"rate": 9.0}, 1)])
        with pytest.raises(StudyError, match=stating("another process", "study")):
            Runs(setup, folder, Here())
    (folder / "runs" / "point_5_seed_1.json").unlink()


def test_runs_of_another_study_are_left_alone(made: tuple[Setup, Path, list[RunRow]], tmp_path: Path) -> None:
    _, folder, rows = made
    for other, what in (
        (setup_of(tmp_path, metrics=METRICS, warm_up=0.2, duration=2.0), r"with another study \(warm_up\), so they"),
        (setup_of(tmp_path, metrics=METRICS, warm_up=0.4, duration=2.0, seeds=1), ""),
    ):
        if what:
            with pytest.raises(StudyError, match=what):
                Runs(other, folder, Here())
        else:  # fewer seeds
            copied = shutil.copytree(folder, tmp_path / "copied")
            with Runs(other, copied, Here()) as runs:
                assert sweep(runs, other) == [row for row in rows if row.seed == 1]


def test_a_metric_that_has_become_another_is_asked_of_new_runs(tmp_path: Path) -> None:
    """Older runs hold values of another metric with the same name."""
    out = tmp_path / "out"
    mean = setup_of(tmp_path, duration=0.5, seeds=3)
    with Runs(mean, out, Here()) as runs:
        first = sweep(runs, mean)
    most = setup_of(tmp_path, duration=0.5, metrics=["stops", {"queue": "maximum belts/conveyor/bottles"}])
    with Runs(most, out, engine := Here()) as runs:
        found = sweep(runs, most)
    assert engine.made == 4 and all(row.metrics["queue"].is_integer() for row in found)
    results = read_results(out)
    assert results.study == most.source and list(results.units) == ["stops", "queue"]
    # Two runs of the third seed are still there, without an answer to what is asked today.
    old = [row for row in results.rows if row.seed == 3]
    assert len(results.rows) == 6 and all(math.isnan(row.metrics["queue"]) for row in old)
    assert [row.metrics["stops"] for row in old] == [row.metrics["stops"] for row in first if row.seed == 3]
    assert any("queue" in sentence for sentence in verdicts(results)) and points_table(results.rows, results.units, {})
    with Runs(mean, out, engine := Here()) as runs:
        assert [row.metrics for row in sweep(runs, mean)] == [row.metrics for row in first]
    assert engine.made == 4
    fewer = setup_of(tmp_path, duration=0.5, metrics=["stops"])
    with Runs(fewer, out, engine := Here()) as runs:
        sweep(runs, fewer)
    assert engine.made == 0 and list(read_results(out).units) == ["stops"]


def test_a_function_of_metrics_may_be_mended(tmp_path: Path) -> None:
    """Its runs are made again, those that failed by it, too; a function that makes the line makes another study."""
    (tmp_path / "mine.py").write_text("from helper import times\ndef fed(simulation):\n    return times(simulation)\n")
    (tmp_path / "helper.py").write_text("def times(simulation):\n    raise ValueError('not yet')\n")
    sys.path.append(str(tmp_path))
    try:
        for body, status in (
            ("raise ValueError('not yet')", "failed"),
            ("return 2.0 * simulation.counts.fed", "finished"),
        ):
            (tmp_path / "helper.py").write_text(f"def times(simulation):\n    {body}\n")
            sys.modules.pop("helper", None)
            setup = setup_of(tmp_path, metrics=[{"fed": "mine.py:fed"}], duration=0.5, seeds=1)
            assert {Path(file).name for file in setup.code} == {"code.py", "mine.py", "helper.py"}
            (tmp_path / "mine.py").touch()  # read again by this process
            with Runs(setup, tmp_path / "out", Here()) as runs:
                rows = sweep(runs, setup)
            assert [row.status for row in rows] == [status] * 2, [row.error for row in rows]
    finally:
        sys.path.remove(str(tmp_path))
    write_study(tmp_path, metrics=[{"fed": "mine.py:fed"}], duration=0.5, seeds=1)
    (tmp_path / "code.py").write_text(CODE + "\n")
    with pytest.raises(StudyError, match="another code"):
        Runs(load_study(tmp_path / "study.yaml"), tmp_path / "out", Here())


def test_the_table_is_a_parquet_file(made: tuple[Setup, Path, list[RunRow]], tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    if find_spec("duckdb") is None:
        pytest.skip("duckdb is not installed")
    setup, folder, rows = made
    results = read_results(folder)
    path = write_parquet(results, tmp_path / "results.parquet")
    again = read_results(path)
    assert (again.rows, again.units, again.study, again.path) == (rows, results.units, setup.source, setup.path)
    assert results.units["throughput"] == "1/min" and results.units["queue"] == results.units["stops"] == "1"
    for frame in (pandas.read_parquet(path), polars.read_parquet(path)):
        assert list(frame["rate"]) == [row.parameters["rate"] for row in rows]
        assert list(frame["queue"]) == [row.metrics["queue"] for row in rows]
        assert list(frame["status"]) == ["finished"] * 6
        assert list(frame["command"]) == [run_command(setup.path, row) for row in rows]
    # In a process of its own, for it says much as it ends.
    query = f"import duckdb; print(duckdb.sql(\"select sum(queue) from '{path}' where rate > 5\").fetchall())"
    found = subprocess.run([sys.executable, "-c", query], capture_output=True, text=True, check=True)
    assert float(found.stdout.strip("[](), \n")) == pytest.approx(sum(row.metrics["queue"] for row in rows[3:]))
    said = [CliRunner().invoke(main, ["study", str(read), "--no-pictures"]) for read in (folder, path)]
    assert said[0].exit_code == 0 and said[0].output == said[1].output
    assert all(sentence in said[0].output.splitlines() for sentence in verdicts(results))
    from pyarrow import parquet

    schema = parquet.read_schema(path)
    assert json.loads(schema.metadata[b"conveyor_sim"])["study"] == setup.source
    assert schema.field("throughput").metadata == {b"unit": b"1/min"}
    assert schema.field("rate").metadata == {b"unit": b"1/s"} and results.parameters == {"rate": "1/s"}


def test_batches_go_on_until_the_mean_is_known(tmp_path: Path) -> None:
    until = {"metric": "queue", "half_width": 0.15}
    setup = setup_of(tmp_path, duration=0.5, seeds={"until": until, "batch": 10, "most": 30})
    from conveyor_sim.statistics.intervals import mean_interval

    engine = Here()
    with Runs(setup, tmp_path / "out", engine) as runs:
        rows = sweep(runs, setup)
    for point in (0, 1):
        values = [row.metrics["queue"] for row in rows if row.point == point]
        widths = {size: mean_interval(values[:size], 0.95).half_width for size in (10, 20, 30) if size <= len(values)}
        assert len(values) in (10, 20, 30)
        assert all(width > 0.15 for size, width in widths.items() if size < len(values))
        assert widths[len(values)] <= 0.15 or len(values) == 30


def test_a_run_that_fails_says_why_and_leaves_a_recording(tmp_path: Path) -> None:
    parameters = {"until": {"controller": "until", "values": [0.3, 2.0]}}
    setup = setup_of(
        tmp_path, parameters=parameters, controller="code.py:Feeder", settings={"speed": 0.5}, duration=0.5, seeds=1
    )
    with Runs(setup, tmp_path / "out", Here()) as runs:
        worn, good = sweep(runs, setup)
    assert (worn.status, worn.error, worn.metrics) == ("failed", "ValueError: the feeder is worn out", {})
    assert good.status == "finished" and not good.bag
    with open_bag(tmp_path / "out" / worn.bag) as bag:
        assert bag.counts["outcomes"] > 0
    every = setup_of(
        tmp_path, parameters=parameters, controller="code.py:Feeder", settings={"speed": 0.5}, duration=0.5, bags="all"
    )
    place = tmp_path / "out" / "bags" / "point_3_seed_1"
    place.mkdir()
    (place / "cut_short.mcap").touch()  # by a process that was killed
    for _ in range(2):
        row = make_row(Work(every, Job(3, {"until": 2.0}, 1), None, tmp_path / "out"))
        assert row.metrics == good.metrics and tmp_path / "out" / row.bag == place
        assert sorted(path.name for path in place.iterdir()) == ["metadata.yaml", "point_3_seed_1_0.mcap"]
    with open_bag(place) as bag:
        assert bag.counts["outcomes"] > 0
    assert sorted(path.name for path in place.parent.iterdir()) == ["point_0_seed_1", "point_3_seed_1"]


def test_a_metric_that_is_no_number_is_said(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def words(simulation):\n    return 'many'\n")
    setup = setup_of(tmp_path, metrics=[{"mine": "mine.py:words"}], duration=0.1)
    row = make_row(Work(setup, Job(0, {"rate": 4.0}, 1)))
    assert row.status == "failed"
    assert missing(row.error, ["words", '"many"', "number"]) == []


def test_controllers_are_compared_from_one_warm_line_a_seed(tmp_path: Path) -> None:
    study: dict[str, Any] = {
        "parameters": {"speed": {"controller": "speed", "values": [0.5, 0.3]}},
        "controller": "code.py:Feeder",
        "settings": {"speed": 0.5},
        "warm_start": 1.0,
        "duration": 0.5,
        "metrics": ["throughput", {"scans": "change machines/first/produced"}, {"all": "code.py:fed"}],
    }
    setup = setup_of(tmp_path, **study)
    with Runs(setup, tmp_path / "out", Here()) as runs:
        rows = sweep(runs, setup)
    assert [row.status for row in rows] == ["finished"] * 4, [row.error for row in rows]
    starts = sorted(path.name for path in (tmp_path / "out" / "warm_starts").glob("*.npz"))
    assert starts == ["seed_1.npz", "seed_2.npz"]
    # Bottles of the warm start are there, but not counted; with its own settings the run is as one without a stop.
    plain = setup_of(tmp_path, **{**study, "warm_start": None, "warm_up": 1.0, "duration": 1.5})
    for row in rows[:2]:
        whole = make_row(Work(plain, Job(0, {"speed": 0.5}, row.seed)))
        assert row.metrics == whole.metrics and row.simulated == 0.5
    assert rows[0].metrics["all"] > rows[0].metrics["scans"]
    # The checkpoint as bytes, as it travels to another machine, and as the run alone makes it.
    # A metric that needs an effect begins from a checkpoint that has it, by the same motion.
    forces = setup_of(tmp_path, **{**study, "metrics": [*study["metrics"], "peak_force"]})
    with Runs(forces, tmp_path / "out", Here()) as runs:
        again = sweep(runs, forces)
    assert [row.status for row in again] == ["finished"] * 4, [row.error for row in again]
    assert all(new.metrics.items() >= old.metrics.items() for new, old in zip(again, rows, strict=True))
    content = warm_start(Work(setup, Job(0, {}, 1)))
    assert make_row(Work(setup, Job(1, {"speed": 0.3}, 1), content)).metrics == rows[2].metrics
    assert run_alone(setup, job_of(setup, ["speed=0.3"], 1), None).metrics == rows[2].metrics


def test_code_that_changes_meanwhile_is_noticed(tmp_path: Path) -> None:
    setup = setup_of(tmp_path)
    (tmp_path / "code.py").write_text("line = None")
    row = make_row(Work(setup, Job(0, {"rate": 4.0}, 1)))
    assert row.status == "lost"
    assert missing(row.error, ["code.py", "changed"]) == []

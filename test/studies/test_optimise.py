# SPDX-License-Identifier: Apache-2.0
"""Optimisation: the best point is found, and found again on any path to it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from facts import missing

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.optimisation.answer import answer, trials_data
from conveyor_sim.studies.optimisation.objective import parse_objective
from conveyor_sim.studies.optimisation.optimise import Optimum, optimise
from conveyor_sim.studies.optimisation.trials import Trial
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.sweep import sweep
from conveyor_sim.support.worker_pool import WorkerPool

HERE = Path(__file__).parent
BOUNDED = "maximise value subject to speed_is < 0.5"
TWO = "maximise value and minimise loss"
TRIALS = 12
UNITS = {"value": "1", "loss": "J", "speed_is": "m/s"}


class Study:
    """A study file, and one process for all its runs."""

    def __init__(self, folder: Path, pool: WorkerPool) -> None:
        self.folder, self.pool = folder, pool
        shutil.copy(HERE / "optimised.py", folder)

    def run(self, objective: str, out: str, trials: int = TRIALS, stop_after: int | None = None) -> Optimum:
        """Optimise by an objective in the folder `out`, and return the result."""
        path = self.folder / "study.yaml"
        path.write_text((HERE / "optimised.py").read_text().split('STUDY = """')[1].split('"""')[0].format(
            objective=objective, trials=trials))  # fmt: skip
        self.made: list[RunRow] = []

        def watch(_done: int, _whole: int, _left: float | None, row: RunRow | None) -> None:
            if row is not None:
                self.made.append(row)
                if len(self.made) == stop_after:
                    raise KeyboardInterrupt

        setup = load_study(path)
        with Runs(setup, self.folder / out, Shared(self.pool)) as runs:
            return optimise(runs, setup, watch)


class Shared:
    """A pool that is not closed with a study."""

    is_here = True

    def __init__(self, pool: WorkerPool) -> None:
        self.processes, self.each = pool.processes, pool.each

    def __enter__(self) -> Shared:
        return self

    def __exit__(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Study]:
    with WorkerPool(1) as pool:
        yield Study(tmp_path_factory.mktemp("optimised"), pool)


@pytest.fixture(scope="module")
def bounded(study: Study) -> Optimum:
    return study.run(BOUNDED, "bounded")


def points(optimum: Optimum) -> list[tuple[object, ...]]:
    return [tuple(trial.parameters.values()) for trial in optimum.trials]


def test_the_best_point_is_near_the_bound_and_better_than_the_start(bounded: Optimum) -> None:
    (best,) = bounded.front
    assert best.parameters["kind"] == "plain" and 0.4 < best.parameters["speed"] < 0.5
    assert points(bounded)[0] == (0.2, "lame") and len(bounded.trials) == TRIALS
    fresh, start = bounded.fresh
    assert {row.seed for row in fresh.rows} == {row.seed for row in start.rows} == set(range(3, 7))
    said = "\n".join(answer(bounded, UNITS))
    assert missing(said, ["speed_is < 0.5", "on average", "4 of 4 runs"]) == []
    assert missing(said, ["significant", "4 seeds", "best is higher than start"]) == []


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([1.0, 1.1, 1.2, 1.3], "in 4 of 4 runs; on average it can't be told"),
        ([1.0, 1.5, 1.0, 1.5], "in 2 of 4 runs; on average it can't be told"),
        ([1.0, 1.0, 1.1, 1.1], "on average, and in 4 of 4 runs"),
        ([2.0, 2.0, 2.1, 2.1], "in 0 of 4 runs; on average not"),
    ],
)
def test_whether_a_bound_is_kept_is_said_with_what_is_not_known(values: list[float], said: str) -> None:
    """The bound is on the mean, of which runs tell where it lies."""
    rows = [RunRow(0, seed, {}, "finished", metrics={"y": value, "loss": value}) for seed, value in enumerate(values)]
    kept = Trial(0, {}, (RunRow(0, 9, {}, "finished", metrics={"y": 1.0, "loss": 1.0}),))
    objective = parse_objective("minimise y subject to loss < 1.35", ["y", "loss"])
    found = Optimum(objective, (kept,), (kept,), (kept,), False, (Trial(0, {}, tuple(rows)),))
    assert f"  loss < 1.35 {said}" in answer(found, {"y": "1", "loss": "J"})


def test_it_is_the_same_again_and_from_where_it_was_interrupted(study: Study, bounded: Optimum) -> None:
    with pytest.raises(KeyboardInterrupt):
        study.run(BOUNDED, "again", stop_after=9)
    again = study.run(BOUNDED, "again")
    # Those that were finished are not made again: at most two were under way beside the ninth.
    assert 2 * TRIALS + 8 - 12 <= len(study.made) <= 2 * TRIALS + 8 - 9
    assert points(again) == points(bounded)
    assert [trial.means for trial in again.fresh] == [trial.means for trial in bounded.fresh]
    study.run(BOUNDED, "again")
    assert study.made == []


def test_more_trials_go_on_from_fewer(study: Study, bounded: Optimum) -> None:
    """Six cut a batch of four."""
    fewer = study.run(BOUNDED, "bounded", trials=6)
    assert points(fewer) == points(bounded)[:6]
    assert all(row.seed > 2 for row in study.made), "only the best of six had no runs with fresh seeds yet"


def test_of_two_goals_the_front_is_what_no_other_point_is_better_than(study: Study) -> None:
    found = study.run(TWO, "two")
    assert len(found.front) > 1 and not found.fresh
    for trial in found.front:
        assert trial.means is not None
        assert not any(found.objective.dominates(other.means, trial.means) for other in found.trials if other.means)
    values = [trial.means["value"] for trial in found.front if trial.means]
    assert values == sorted(values)
    data = trials_data("parabola", found, UNITS)
    assert data.labels == ("value", "loss (J)") and data.means.shape == (TRIALS, 2) and data.kept.all()
    assert len(list(answer(found, UNITS))) == 1 + len(found.front)


def test_where_no_point_keeps_the_bounds_it_says_so(study: Study) -> None:
    found = study.run("maximise value subject to speed_is > 5", "none", trials=4)
    (line,) = answer(found, UNITS)
    assert missing(line, ["no point of 4", "speed_is > 5"]) == []


def test_points_whose_runs_fail_are_passed_over(study: Study) -> None:
    lines = (study.folder / "optimised.py").read_text()
    broken = lines.replace(
        "    return simulation.scene", "    assert simulation.scene.seed != 2\n    return simulation.scene"
    )
    (study.folder / "optimised.py").write_text(broken)
    try:
        found = study.run(BOUNDED, "broken", trials=4)
    finally:
        (study.folder / "optimised.py").write_text(lines)
    first, last = answer(found, UNITS)
    assert missing(first, ["4 of 4 points", "failed", "AssertionError"]) == []
    assert missing(last, ["no point of 4", "speed_is < 0.5"]) == []


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"speed: 0.2": "speed: 2.0"}, "optimise.start.speed: 2 given, expected a number from 0.1 to 0.9"),
        ({"kind: lame": "kind: odd"}, 'optimise.start.kind: "odd" given, expected "plain" or "lame"'),
        ({"speed: 0.2, ": ""}, 'optimise.start: "kind" given, expected a value for each of speed, kind'),
        ({"seeds: 2": "design: list\nseeds: 2"}, "design: given, expected none beside optimise"),
        ({"seeds: 2": "seeds: {until: {metric: value, half_width: 1.0}}"}, "seeds: expected a count"),
        ({BOUNDED: "maximise speed"}, 'optimise.objective: "maximise speed": found "speed", expected a metric'),
    ],
)
def test_a_study_that_can_not_be_optimised_is_refused_in_words(
    study: Study, wrong: dict[str, str], sentence: str
) -> None:
    study.run(BOUNDED, "bounded")
    text = (study.folder / "study.yaml").read_text()
    for old, new in wrong.items():
        assert old in text
        text = text.replace(old, new)
    path = study.folder / "wrong.yaml"
    path.write_text(text)
    with pytest.raises(StudyError) as refused:
        load_study(path)
    assert sentence in str(refused.value)


def test_a_sweep_of_it_is_refused_and_an_optimisation_of_a_sweep(study: Study, tmp_path: Path) -> None:
    study.run(BOUNDED, "bounded")
    setup = load_study(study.folder / "study.yaml")
    refused = pytest.raises(StudyError, match="expected conveyor-sim optimise")
    with Runs(setup, tmp_path / "out", Shared(study.pool)) as runs, refused:
        sweep(runs, setup)
    text = (study.folder / "study.yaml").read_text().partition("optimise:")[0]
    (study.folder / "plain.yaml").write_text(text.replace("low: 0.1, high: 0.9", "values: [0.1]"))
    plain, refused = load_study(study.folder / "plain.yaml"), pytest.raises(StudyError, match="optimise: missing")
    with Runs(plain, tmp_path / "plain", Shared(study.pool)) as runs, refused:
        optimise(runs, plain)

# SPDX-License-Identifier: Apache-2.0
"""A study as a whole: its parts fit, and one that was killed goes on to the same tables."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from conveyor_sim.accuracy.candidates import SWEEPS
from conveyor_sim.accuracy.effort import PROCESSORS, RESERVE, Effort
from conveyor_sim.accuracy.measure import timing
from conveyor_sim.accuracy.measure.sample_file import SAMPLES
from conveyor_sim.accuracy.measured import MEASURED, first_settings
from conveyor_sim.accuracy.report.files import read_study
from conveyor_sim.accuracy.report.forecast import forecast
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.study import FIRST_RUNS, affordable, run_study, study_folder
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import load_scene, parse_scene

pytestmark = pytest.mark.usefixtures("brief_costs")

SCENE = """\
name: three
duration: 0.3
tick: 0.005
contacts: [{between: [glass, glass], stiffness: 20000}]
bottle_types: {jar: {radius: 0.05, mass: 0.2, material: glass}}
floor: none
effects: {unequal_radii: on}  # as in test_horizon.py, for the kernels
bottles:
  - {type: jar, position: [0, 0], velocity: [0.8, 0]}
  - {type: jar, position: [0.13, 0.01]}
  - {type: jar, position: [0.26, -0.01]}
"""

ONE_RUN = Effort(budget=0.0)
"""One long run of each setting: where they are as short as here, those are made in any case."""

NO_TIME = Effort(budget=0.0, measuring=0.0)
"""Spent before the first setting is measured."""


class Silent:
    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        pass


def silent(_what: str, _counted: str) -> AbstractContextManager[Silent]:
    return nullcontext(Silent())


def main(file: str, folder: str, chunk: float) -> None:
    """What the child of the test below does, with costs measured as briefly as in its parent."""
    timing.CHUNK = chunk
    run_study(load_scene(file), Path(folder), 0.01, ONE_RUN, silent)


def without_times(study: AccuracyStudy) -> AccuracyStudy:
    """All of it but the processor time that it took."""
    return replace(study, cpu=None, samples=tuple(replace(sample, cpu=0.0) for sample in study.samples))


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory, brief_costs: None) -> Path:
    """The folder of a study whose process was killed in the middle of its long runs, and beside it its scene."""
    root = tmp_path_factory.mktemp("study")
    (root / "scene.yaml").write_text(SCENE)
    folder = root / "killed"
    code = f"import test_study; test_study.main({str(root / 'scene.yaml')!r}, {str(folder)!r}, {timing.CHUNK})"
    child = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parent)
    while child.poll() is None and not (folder / SAMPLES).exists():
        time.sleep(0.05)
    while child.poll() is None and (folder / SAMPLES).read_bytes().count(b"\n") < 2:
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL, "the study ended before it could be killed"
    return folder


def test_a_killed_study_goes_on_to_the_same_tables(interrupted: Path) -> None:
    """A resumed study keeps finished measurements and runs, and ends with the tables of an uninterrupted one."""
    scene = load_scene(interrupted.parent / "scene.yaml")
    copy = interrupted.with_name("from_measured")
    copy.mkdir()
    for name in (MEASURED, "origin.json"):
        shutil.copy(interrupted / name, copy)
    before = (interrupted / SAMPLES).read_bytes()
    resumed = run_study(scene, interrupted, 0.01, ONE_RUN, silent)
    whole = run_study(scene, copy, 0.01, ONE_RUN, silent)
    assert (interrupted / SAMPLES).read_bytes().startswith(before[: before.rfind(b"\n") + 1])
    assert without_times(resumed) == without_times(whole)
    assert read_study(interrupted / "study.json") == resumed

    assert resumed.answer is not None
    assert resumed.answer.error <= 0.01
    settings = {point.setting: point for point in resumed.points}
    exact = settings[resumed.answer.setting].errors
    assert exact is not None
    assert exact.peak_force == resumed.answer.error
    assert resumed.flow is not None
    assert {(row.setting.per_tick, row.setting.sweeps) for row in resumed.flow.rows} == set(SWEEPS)
    assert {row.verdict for row in resumed.flow.rows} <= {"undecided", "equivalent", "failed", "too deep"}
    assert {row.factor for row in resumed.stiffness} >= {1.0, 0.25}
    soft = next(row for row in resumed.stiffness if row.factor == 0.25)
    stiff = next(row for row in resumed.stiffness if row.factor == 1.0)
    # Impact peaks go as the root of the stiffness.
    ratio = soft.observables["peak force, 99th percentile"][0] / stiff.observables["peak force, 99th percentile"][0]
    assert ratio == pytest.approx(0.5, rel=0.1)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory, brief_costs: None) -> tuple[Path, AccuracyStudy]:
    """A study whose budget was spent before it began, and its folder."""
    folder = tmp_path_factory.mktemp("short")
    return folder, run_study(parse_scene(SCENE, "three.yaml"), folder, 0.01, NO_TIME, silent)


def test_a_budget_that_is_spent_leaves_settings_out_and_names_them(short: tuple[Path, AccuracyStudy]) -> None:
    """The first settings are measured in any case; a small budget keeps them."""
    folder, study = short
    scene = parse_scene(SCENE, "three.yaml")
    predicted = forecast(scene, 0.01).point
    assert predicted is not None
    first = first_settings(scene, 0.01)
    assert first[0] == predicted.setting
    assert {point.setting for point in study.points} == set(first)
    assert study.answer is not None
    assert study.orders == ()
    facts = ("not run", "budget", "--thorough")
    assert any(all(fact in sentence for fact in facts) for sentence in study.skipped)
    (left_out,) = [sentence for sentence in study.skipped if sentence.startswith("Not measured within the budget")]
    assert "rk4" in left_out
    again = run_study(scene, folder, 0.01, NO_TIME, silent)
    assert again.points == study.points


def test_a_larger_budget_measures_the_others_and_the_time_left_holds(
    short: tuple[Path, AccuracyStudy], tmp_path: Path
) -> None:
    """The bounds of all phases, in the order shown: none grows, and each covers the time that is spent after it."""
    for name in (MEASURED, "origin.json"):  # without long runs, which a busy machine may have made
        shutil.copy(short[0] / name, tmp_path)
    shown: list[tuple[str, float]] = []

    class Recorded:
        def __init__(self, stage: str) -> None:
            self.stage = stage

        def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
            assert left is not None, self.stage
            shown.append((self.stage, left))

    effort = Effort(budget=10.0)
    study = run_study(
        parse_scene(SCENE, "three.yaml"),
        tmp_path,
        0.01,
        effort,
        lambda what, _counted: nullcontext(Recorded(what)),
    )
    assert len(study.points) > len(short[1].points)
    assert study.orders
    assert not any("within the budget" in sentence for sentence in study.skipped)
    stages, bounds = zip(*shown, strict=True)
    assert sum("long runs" in stage for stage in dict.fromkeys(stages)) == 3
    assert all(later <= earlier for earlier, later in pairwise(bounds))
    assert len({sample.seed for sample in study.samples}) > 1
    assert study.cpu is not None
    runs = sum(sample.cpu for sample in study.samples)
    # A bound is the limit less the time spent, or less.
    spent = study.cpu - runs + runs / PROCESSORS
    assert effort.limit >= bounds[0] > bounds[-1] > 0.0
    assert effort.limit - bounds[-1] >= spent - 0.1 * RESERVE


def test_runs_that_do_not_fit_the_budget_are_not_begun() -> None:
    """One run each, in order, up to the budget or a few seconds; what is not known costs nothing."""
    one, two, three, unknown = (Setting("leapfrog", steps) for steps in (1, 2, 3, 4))
    expected = {one: 30.0, two: 40.0, three: 50.0}
    assert affordable([one, two, three], expected, 75.0) == [one, two]
    assert affordable([two, one, unknown], expected, 70.0) == [two, one, unknown]
    assert affordable([one, two], expected, 29.0) == []
    assert affordable([one, two], expected, 139.0, runs=2) == [one]
    assert affordable([one, two], expected, 140.0, runs=2) == [one, two]
    assert affordable([one], {one: FIRST_RUNS}, 0.0) == [one]
    assert affordable([one], {one: 1.01 * FIRST_RUNS}, 0.0) == []


def test_a_folder_of_another_scene_is_refused(interrupted: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(SCENE.replace("0.8, 0", "0.9, 0"))
    before = {file.name: file.read_bytes() for file in interrupted.iterdir() if file.is_file()}
    with pytest.raises(ConveyorError, match=r"origin\.json: .* another scene"):
        run_study(load_scene(other), interrupted, 0.01, ONE_RUN, silent)
    assert {file.name: file.read_bytes() for file in interrupted.iterdir() if file.is_file()} == before
    assert study_folder(load_scene(other)) != study_folder(load_scene(interrupted.parent / "scene.yaml"))


def test_damaged_measurements_are_named(interrupted: Path, tmp_path: Path) -> None:
    copy = tmp_path / "damaged"
    copy.mkdir()
    shutil.copy(interrupted / "origin.json", copy)
    (copy / MEASURED).write_text('{"machine": 3}')
    with pytest.raises(ConveyorError, match=r"measured\.json: .*expected"):
        run_study(load_scene(interrupted.parent / "scene.yaml"), copy, 0.01, ONE_RUN, silent)


def test_keys_of_settings_tell_them_apart() -> None:
    settings = [
        Setting("rk4", 10),
        Setting("rk4", 100),
        Setting("rk4", 10, 0.25),
        Setting("dormand_prince", 10, error=1e-6),
        Setting("dormand_prince", 10, error=1e-5),
    ]
    assert len({setting.key for setting in settings}) == len(settings)

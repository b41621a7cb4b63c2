# SPDX-License-Identifier: Apache-2.0
"""Answers that a user sees while a study runs, in order, and the answer after Ctrl-C at any moment."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from accuracy.test_study import ONE_RUN, SCENE, silent
from click.testing import CliRunner
from facts import missing

from conveyor_sim.accuracy.candidates import own_setting, preset_setting
from conveyor_sim.accuracy.effort import DEFAULT, THOROUGH, Effort
from conveyor_sim.accuracy.measure import timing
from conveyor_sim.accuracy.measure.sample_file import SAMPLES
from conveyor_sim.accuracy.report.files import read_study
from conveyor_sim.accuracy.report.interim import MEASURED, PREDICTED, PRELIMINARY, UNFINISHED
from conveyor_sim.accuracy.report.lines import summary
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.accuracy.session import ANSWER, Session
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.cli import main
from conveyor_sim.scene import Scene, load_scene, parse_scene

APART = SCENE.replace("[0.13, 0.01]", "[5.0, 0.0]").replace("[0.26, -0.01]", "[9.0, 0.0]")
"""The same three, none of which reaches another."""

PATIENCE = 600.0
"""s of wall time; kernels may have to be compiled."""


def scene_of(text: str) -> Scene:
    return parse_scene(text, "three.yaml")


def session(text: str) -> tuple[Session, list[str]]:
    answers: list[str] = []
    return Session(scene_of(text), 0.01, answers.append, answers.append), answers


@dataclass(frozen=True)
class Made:
    """A study from its prediction to its end."""

    setting: Setting | None
    folder: Path
    predicted: list[str]
    """Lines before anything ran."""
    answers: list[str]
    study: AccuracyStudy


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, brief_costs: None) -> Made:
    """Its kernels are compiled: a child that loads them is interrupted in what it does, not in compiling."""
    it, answers = session(SCENE)
    folder = tmp_path_factory.mktemp("made")
    it.predict(folder, ONE_RUN)
    predicted = list(answers)
    assert not list(folder.iterdir())
    study = it.run(folder, ONE_RUN, silent)
    assert study is not None
    return Made(it.setting, folder, predicted, answers, study)


def test_predicted_first_then_preliminary_then_the_answer(made: Made) -> None:
    answers, study = made.answers, made.study
    assert made.predicted[0] == PREDICTED
    titles = [line for line in answers if line in (PREDICTED, PRELIMINARY, MEASURED, UNFINISHED, ANSWER)]
    assert titles == [PREDICTED, PRELIMINARY, ANSWER]
    assert answers[answers.index(ANSWER) + 1 :] == summary(study)
    assert study == read_study(made.folder / "study.json")
    assert study.answer is not None
    assert made.setting == study.answer.setting
    early = answers[answers.index(PRELIMINARY) + 1 : answers.index(ANSWER)]
    assert early[0].startswith("Forces: 0.")
    assert early[1].startswith("Throughput: not known")
    assert missing(early[1], ["no long run"]) == []
    assert early[-1].startswith("Not known yet: ")


def test_a_line_on_which_nothing_touches_is_not_searched(tmp_path: Path) -> None:
    it, answers = session(APART)
    it.predict(tmp_path, ONE_RUN)
    assert it.run(tmp_path, ONE_RUN, silent) is None
    forces, throughput, cost, setting, otherwise = answers[answers.index(ANSWER) + 1 :]
    assert PRELIMINARY not in answers
    assert forces.startswith("Forces: ")
    assert missing(forces, ["none", "no bottle touched", "rail", "0.3 s"]) == []
    assert throughput.startswith("Throughput: bottles only ride, so the friction of belts alone decides it")
    assert "an estimate" in cost
    assert missing(setting, ["preset draft", "cheapest", "bound of stability"]) == []
    assert otherwise.startswith("If bottles touch (a stop, a jam, other commands), draft has a predicted error")
    assert it.setting is not None
    assert not (tmp_path / "measured.json").exists()


def test_where_nothing_can_touch_nothing_runs(tmp_path: Path) -> None:
    alone = "\n".join(SCENE.splitlines()[:-2]) + "\n"
    it, answers = session(alone)
    it.predict(tmp_path, ONE_RUN)
    assert it.run(tmp_path / "none", ONE_RUN, silent) is None
    assert answers[0] == ANSWER
    assert missing(answers[1], ["Forces", "none", "nothing in the scene can touch"]) == []
    assert not any(line.startswith("If they do touch") for line in answers)
    assert not (tmp_path / "none").exists()


def test_the_command_answers_on_such_a_line_and_applies_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("alone.yaml").write_text("\n".join(SCENE.splitlines()[:-2]) + "\n")
    result = CliRunner().invoke(main, ["accuracy", "alone.yaml", "--out", "out", "--apply"])
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    forces = " ".join(line for line in lines if line.startswith("Forces: "))
    assert missing(forces, ["none"]) == []
    assert lines[-1].endswith(": out/alone.yaml")
    draft = preset_setting(load_scene(Path("alone.yaml")), "draft")
    assert own_setting(load_scene(Path("out/alone.yaml"))) == draft


@pytest.mark.parametrize(("effort", "minutes"), [(DEFAULT, 5), (THOROUGH, 51)])
def test_how_long_it_takes_is_said_at_first(effort: Effort, minutes: int, tmp_path: Path) -> None:
    said: list[str] = []
    Session(scene_of(SCENE), 0.01, lambda line: None, said.append).predict(tmp_path, effort)
    assert said[0] == PREDICTED
    assert missing(said[-1], ["preliminary answer", "a minute", str(minutes), "compiling"]) == []


def interrupted(folder: Path, ready: Callable[[str], bool]) -> tuple[int, list[str], str]:
    """Exit status, lines of answers and of progress of the command, sent SIGINT once `ready` accepts its progress."""
    file = folder / "three.yaml"
    file.write_text(SCENE)
    progress = folder / "progress.txt"
    brief = f"from conveyor_sim.accuracy.measure import timing; timing.CHUNK = {timing.CHUNK}"
    code = f"{brief}; from conveyor_sim.cli import main; main()"
    command = [sys.executable, "-c", code, "accuracy", str(file), "--out", str(folder / "out"), "--thorough"]
    with (
        open(progress, "w") as errors,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=errors, env={**os.environ, "COLUMNS": "200"}
        ) as process,
    ):
        end = time.monotonic() + PATIENCE
        while not ready(progress.read_text()):
            assert process.poll() is None and time.monotonic() < end, progress.read_text()
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        answers = process.communicate(timeout=PATIENCE)[0].decode()
        return process.returncode, answers.splitlines(), progress.read_text()


def test_ctrl_c_before_anything_is_measured_answers_what_is_predicted(tmp_path: Path, made: Made) -> None:
    status, answers, errors = interrupted(tmp_path, lambda said: PREDICTED in said)
    assert (status, errors.splitlines()[-1]) == (130, "interrupted")
    assert missing(errors, ["answer", "51", "compiling"]) == []  # --thorough
    assert PRELIMINARY not in errors
    assert answers[0] == f"Interrupted; the best answer so far. {PREDICTED}"
    assert [line.partition(":")[0] for line in answers[-5:]] == ["Forces", "Throughput", "Cost", "Setting", "Warning"]
    assert "predicted" in answers[-5]


def test_ctrl_c_after_the_first_settings_answers_what_was_measured(tmp_path: Path, made: Made) -> None:
    status, answers, errors = interrupted(tmp_path, lambda said: "Not known yet" in said)
    assert (status, errors.splitlines()[-1]) == (130, "interrupted")
    assert errors.count(PRELIMINARY) == 1
    assert answers[0] == f"Interrupted; the best answer so far. {PRELIMINARY}"
    assert "\n".join(answers[1:]) in errors
    assert answers[1].startswith("Forces: ")
    assert not (tmp_path / "out" / "study.json").exists()


def test_ctrl_c_in_long_runs_answers_with_those_made(tmp_path: Path, made: Made) -> None:
    samples = tmp_path / "out" / SAMPLES

    def some(_said: str) -> bool:
        return samples.exists() and samples.read_bytes().count(b"\n") > 4

    status, answers, errors = interrupted(tmp_path, some)
    assert (status, errors.splitlines()[-1]) == (130, "interrupted")
    best = answers[answers.index(f"Interrupted; the best answer so far. {UNFINISHED}") + 1 :]
    assert [line.partition(":")[0] for line in best] == ["Forces", "Throughput", "Cost", "Setting", "Not known yet"]
    assert missing(best[-1], ["finished", "same command"]) == []
    assert ANSWER not in answers

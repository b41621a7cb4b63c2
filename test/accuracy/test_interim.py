"""Answers on the way: each says how it is known, and what is not yet known of it."""

from __future__ import annotations

from dataclasses import replace

from accuracy.studies import study
from accuracy.test_lines import row, with_runs

from conveyor_sim.accuracy.report.interim import (
    MEASURED,
    PRELIMINARY,
    UNFINISHED,
    after_measuring,
    preliminary,
    unfinished,
)
from conveyor_sim.accuracy.report.lines import three_lines


def test_a_preliminary_answer_has_measured_impacts_alone() -> None:
    of = study()
    assert of.answer is not None
    early = replace(of, rest=None, comparisons=(), samples=(), answer=replace(of.answer, resting=None))
    found = preliminary(early)
    forces, throughput, cost, setting, unknown = found.lines
    assert found.title == PRELIMINARY
    assert forces.startswith("Forces: good to 0.845 % when bottles hit something (asked: 1 %);")
    assert "what presses for long was not looked at, and is predicted to be good to 0.042 %" in forces
    assert throughput == "Throughput: not known, no long run was made."
    assert cost.startswith("Cost: a second of the line takes 0.0333 s")
    assert setting == "Setting: accuracy: {integrator: velocity_verlet, per_tick: 100}"
    assert unknown.startswith("Not known yet: what presses for long was not measured, nor was throughput")


def test_without_an_answer_no_setting_is_named() -> None:
    found = preliminary(replace(study(), answer=None, tolerance=1e-9))
    assert found.lines[0].startswith("Forces: no setting that was tried is good to 1e-7 %")
    assert not any(line.startswith("Setting:") for line in found.lines)


def test_before_long_runs_nothing_is_said_of_throughput() -> None:
    found = after_measuring(study())
    assert found.title == MEASURED
    assert found.lines[1] == "Throughput: not known, no long run was made."
    assert found.lines[-1] == "Not known yet: throughput, and whether long runs agree with it."


def test_of_unfinished_long_runs_what_those_made_say() -> None:
    of = with_runs(row("throughput", "undecided", 0.13))
    found = unfinished(of)
    runs = sum(not sample.failure for sample in of.samples)
    assert found.title == UNFINISHED
    assert found.lines[:3] == three_lines(of)
    assert "not known better than +- 13 %" in found.lines[1]
    assert f"{runs} were finished" in found.lines[-1]

# SPDX-License-Identifier: Apache-2.0
"""Answers on the way: each says how it is known, and what is not yet known of it."""

from __future__ import annotations

from dataclasses import replace

from accuracy.studies import study
from accuracy.test_lines import row, with_runs
from facts import missing

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
    assert forces.startswith("Forces: ")
    assert missing(forces, ["0.873 %", "1 %", "predicted", "0.042 %"]) == []
    assert throughput.startswith("Throughput: not known")
    assert missing(throughput, ["no long run"]) == []
    assert cost.startswith("Cost: ")
    assert missing(cost, ["0.0338 s"]) == []
    assert setting == "Setting: accuracy: {integrator: velocity_verlet, per_tick: 100}"
    assert unknown.startswith("Not known yet: ")
    assert missing(unknown, ["throughput", "not measured"]) == []


def test_without_an_answer_no_setting_is_named() -> None:
    found = preliminary(replace(study(), answer=None, tolerance=1e-9))
    assert missing(found.lines[0], ["Forces", "no setting", "1e-7 %"]) == []
    assert not any(line.startswith("Setting:") for line in found.lines)


def test_before_long_runs_nothing_is_said_of_throughput() -> None:
    found = after_measuring(study())
    assert found.title == MEASURED
    assert found.lines[1].startswith("Throughput: not known")
    assert missing(found.lines[1], ["no long run"]) == []
    assert found.lines[-1].startswith("Not known yet: ")
    assert missing(found.lines[-1], ["throughput", "long runs"]) == []


def test_of_unfinished_long_runs_what_those_made_say() -> None:
    of = with_runs(row("throughput", "undecided", 0.13))
    found = unfinished(of)
    runs = sum(not sample.failure for sample in of.samples)
    assert found.title == UNFINISHED
    assert found.lines[:3] == three_lines(of)
    assert missing(found.lines[1], ["not known", "+- 13 %"]) == []
    assert f"{runs} were finished" in found.lines[-1]

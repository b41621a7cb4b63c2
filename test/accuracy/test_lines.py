# SPDX-License-Identifier: Apache-2.0
"""The first three lines of an answer: what a line engineer can act on without a word about integrators."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from accuracy.studies import CHOSEN, study
from facts import missing

from conveyor_sim.accuracy.report.lines import summary, three_lines
from conveyor_sim.accuracy.results import AccuracyStudy, Comparison
from conveyor_sim.physics.timestep.prediction import DEEP, percent

FORCES_ONLY = ("impacts and resting forces only",)
JARGON = ("integrator", "euler", "verlet", "rk4", "step", "rms", "dt", "order", "convergence")


def with_runs(*rows: Comparison, accepted: bool = False) -> AccuracyStudy:
    of = study()
    assert of.answer is not None
    return replace(of, comparisons=rows, answer=replace(of.answer, accepted=accepted))


def row(observable: str, verdict: str, reach: float, runs: int = 8) -> Comparison:
    return Comparison(CHOSEN, observable, runs, 100.0, 1.0, 100.0, 1.0, -reach, 0.5 * reach, 0.01, verdict)


def test_forces_throughput_and_cost_in_this_order() -> None:
    of = study()
    assert of.answer is not None and of.answer.resting is not None
    forces, throughput, cost = three_lines(of)
    assert forces.startswith("Forces: ")
    assert missing(forces, ["0.873 %", "0.03 %", "1 %"]) == []
    assert forces.index("0.873 %") < forces.index("0.03 %") < forces.index("1 %")
    assert throughput.startswith("Throughput: ")
    assert cost.startswith("Cost: ")
    assert missing(cost, ["0.0338 s", "one processor", "ten times", "4.9 times"]) == []


@pytest.mark.parametrize("accepted", [False, True])
def test_they_are_free_of_jargon(accepted: bool) -> None:
    for line in three_lines(with_runs(row("throughput", "equivalent", 0.004), accepted=accepted)):
        words = line.lower().replace(",", " ").replace(".", " ").split()
        assert not set(words) & set(JARGON)


def test_what_long_runs_accept_is_good_to_the_tolerance() -> None:
    of = with_runs(row("throughput", "equivalent", 0.004), row("spacing", "equivalent", 0.002), accepted=True)
    queue = with_runs(row("mean queue force", "equivalent", 0.004), row("spacing", "equivalent", 0.002), accepted=True)
    throughput = three_lines(queue)[1]
    assert missing(throughput, ["Throughput", "nothing", "1 %", "8 long runs", "mean queue force", "spacing"]) == []
    throughput = three_lines(of)[1]
    assert missing(throughput, ["Throughput", "1 %", "8 long runs", "spacing"]) == []
    assert "nothing" not in throughput and throughput.count("1 %") == 2


def test_what_is_undecided_is_for_forces_only() -> None:
    """With how well it is known: a mean that may be off by 6 % is never told as if fine."""
    of = with_runs(row("throughput", "undecided", 0.13), row("mean queue force", "undecided", 0.06))
    facts = ["Throughput", "not known", "+- 13 %", "mean queue force +- 6 %", *FORCES_ONLY, "8 long runs"]
    assert missing(three_lines(of)[1], facts) == []
    decided = with_runs(row("throughput", "equivalent", 0.004), row("mean queue force", "undecided", 0.06))
    assert missing(three_lines(decided)[1], ["Throughput", "1 %", "mean queue force +- 6 %", *FORCES_ONLY]) == []
    none = with_runs(row("mean queue force", "undecided", math.inf))
    assert missing(three_lines(none)[1], ["nothing", "mean queue force not known"]) == []


@pytest.mark.parametrize("rows", [(), (row("throughput", "undecided", math.inf, runs=1),)])
def test_few_runs_compare_nothing(rows: tuple[Comparison, ...]) -> None:
    facts = ["Throughput: not known", "too few long runs", *FORCES_ONLY, "--thorough"]
    assert missing(three_lines(with_runs(*rows))[1], facts) == []


def test_a_setting_that_others_were_compared_with_was_compared_with_none() -> None:
    """Cheaper settings differed from it; its own error was not measured."""
    of = replace(with_runs(), ensemble_reference=CHOSEN)
    facts = ["Throughput", "cheaper settings", "differ", "long runs", "none", *FORCES_ONLY]
    assert missing(three_lines(of)[1], facts) == []


def test_a_scene_that_never_settles_says_so() -> None:
    of = study()
    assert of.answer is not None and of.rest is not None
    rest = replace(of.rest, setting=None, reason="the forces that last were still changing at 9 s")
    never = replace(of, rest=rest, answer=replace(of.answer, resting=None))
    assert missing(three_lines(never)[0], ["1 %", rest.reason, "predicted", "0.042 %"]) == []


def test_a_predicted_error_is_never_zero() -> None:
    of = study()
    assert of.answer is not None
    points = tuple(replace(point, predicted_resting=0.0) for point in of.points)
    forces = three_lines(replace(of, points=points, rest=None, answer=replace(of.answer, resting=None)))[0]
    assert missing(forces, ["Resting load", "predicted error below 0.01 %"]) == []


def test_no_answer_is_three_lines_too() -> None:
    forces, throughput, cost = three_lines(replace(study(), answer=None, tolerance=1e-9))
    assert missing(forces, ["Forces", "no setting", "1e-7 %", "best"]) == []
    assert (throughput[:11], cost[:5]) == ("Throughput:", "Cost:")


def test_below_them_the_setting_and_what_the_study_took() -> None:
    of = replace(study(), moving="The strokes of moving rails are not covered: they stood still throughout.")
    lines = summary(of)
    assert tuple(lines[:3]) == three_lines(of)
    assert "accuracy: {integrator: velocity_verlet, per_tick: 100}" in lines[3]
    assert missing(lines[4], ["Scene", "impacts", "2.4 %", "resting load"]) == []
    assert lines[5] == of.moving
    assert missing(lines[6], ["412 s", "processor time", "75 s", "compiling"]) == []
    shaky = tuple(replace(point, beyond=1.99) if point.setting == of.own else point for point in of.points)
    assert missing(summary(replace(of, points=shaky))[4], ["step", "1.99 x", "bound of stability"]) == []


@pytest.mark.parametrize(("share", "warned"), [(None, False), (1.0, False), (1.5, True)])
def test_deep_overlaps_are_warned_of_at_the_scene_s_own_stiffness(share: float | None, warned: bool) -> None:
    own, *softer = sorted(study().stiffness, key=lambda one: -one.factor)
    assert own.factor == 1.0
    rows = (
        replace(own, overlap=None if share is None else share * DEEP),
        *(replace(one, overlap=0.5) for one in softer),
    )
    lines = [line for line in summary(replace(study(), stiffness=rows)) if line.startswith("Warning")]
    assert [missing(line, [percent(1.5 * DEEP), percent(DEEP), "throughput"]) for line in lines] == [[]] * warned

"""The first three lines of an answer: what a line engineer can act on without a word about integrators."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from accuracy.studies import CHOSEN, study

from conveyor_sim.accuracy.report.lines import summary, three_lines
from conveyor_sim.accuracy.results import Comparison, Study

JARGON = ("integrator", "euler", "verlet", "rk4", "step", "rms", "dt", "order", "convergence")


def with_runs(*rows: Comparison, accepted: bool = False) -> Study:
    of = study()
    assert of.answer is not None
    return replace(of, comparisons=rows, answer=replace(of.answer, accepted=accepted))


def row(observable: str, verdict: str, reach: float, runs: int = 8) -> Comparison:
    return Comparison(CHOSEN, observable, runs, 100.0, 1.0, 100.0, 1.0, -reach, 0.5 * reach, 0.01, verdict)


def test_forces_throughput_and_cost_in_this_order() -> None:
    of = study()
    assert of.answer is not None and of.answer.resting is not None
    forces, throughput, cost = three_lines(of)
    assert forces == (
        "Forces: good to 0.845 % when bottles hit something, and to 0.03 % where they press for long (asked: 1 %)."
    )
    assert throughput.startswith("Throughput: ")
    assert cost == (
        "Cost: a second of the line takes 0.0333 s of one processor; ten times better takes 4.9 times as long."
    )


@pytest.mark.parametrize("accepted", [False, True])
def test_they_are_free_of_jargon(accepted: bool) -> None:
    for line in three_lines(with_runs(row("throughput", "equivalent", 0.004), accepted=accepted)):
        words = line.lower().replace(",", " ").replace(".", " ").split()
        assert not set(words) & set(JARGON)


def test_what_long_runs_accept_is_good_to_the_tolerance() -> None:
    of = with_runs(row("throughput", "equivalent", 0.004), row("spacing", "equivalent", 0.002), accepted=True)
    queue = with_runs(row("mean queue force", "equivalent", 0.004), row("spacing", "equivalent", 0.002), accepted=True)
    assert three_lines(queue)[1] == (
        "Throughput: nothing leaves or comes round in this scene; "
        "to 1 % 8 long runs agree in mean queue force; spacing."
    )
    assert three_lines(of)[1] == "Throughput: good to 1 %; to 1 % 8 long runs agree in spacing."


def test_what_is_undecided_is_for_forces_only() -> None:
    """With how well it is known: a mean that may be off by 6 % is never told as if fine."""
    of = with_runs(row("throughput", "undecided", 0.13), row("mean queue force", "undecided", 0.06))
    assert three_lines(of)[1] == (
        "Throughput: not known better than +- 13 %; mean queue force +- 6 %; rely on this setting for impacts and "
        "resting forces only (8 long runs)."
    )
    decided = with_runs(row("throughput", "equivalent", 0.004), row("mean queue force", "undecided", 0.06))
    assert three_lines(decided)[1].startswith("Throughput: good to 1 %; mean queue force +- 6 %; rely on")
    none = with_runs(row("mean queue force", "undecided", math.inf))
    assert "nothing leaves or comes round in this scene; mean queue force not known;" in three_lines(none)[1]


@pytest.mark.parametrize("rows", [(), (row("throughput", "undecided", math.inf, runs=1),)])
def test_few_runs_compare_nothing(rows: tuple[Comparison, ...]) -> None:
    assert three_lines(with_runs(*rows))[1] == (
        "Throughput: not known, too few long runs were made; rely on this setting for impacts and resting forces only "
        "(--thorough makes more)."
    )


def test_a_setting_that_others_were_compared_with_was_compared_with_none() -> None:
    """Cheaper ones were found different from it; how good it is itself nobody has looked at."""
    of = replace(with_runs(), ensemble_reference=CHOSEN)
    assert three_lines(of)[1] == (
        "Throughput: cheaper settings differ from this one in long runs, and none was run that is better; "
        "rely on this setting for impacts and resting forces only."
    )


def test_a_scene_that_never_settles_says_so() -> None:
    of = study()
    assert of.answer is not None and of.rest is not None
    rest = replace(of.rest, setting=None, reason="the forces that last were still changing at 9 s")
    never = replace(of, rest=rest, answer=replace(of.answer, resting=None))
    assert three_lines(never)[0].endswith(
        "(asked: 1 %); what presses for long could not be compared (the forces that last were still changing at 9 s), "
        "and is predicted to be good to 0.042 %."
    )


def test_no_answer_is_three_lines_too() -> None:
    forces, throughput, cost = three_lines(replace(study(), answer=None, tolerance=1e-9))
    assert forces.startswith("Forces: no setting that was tried is good to 1e-7 %; the best is good to ")
    assert (throughput[:11], cost[:5]) == ("Throughput:", "Cost:")


def test_below_them_the_setting_and_what_the_study_took() -> None:
    of = replace(study(), moving="The strokes of moving rails are not covered: they stood still throughout.")
    lines = summary(of)
    assert tuple(lines[:3]) == three_lines(of)
    assert "accuracy: {integrator: velocity_verlet, per_tick: 100}" in lines[3]
    assert lines[4].startswith("The scene's own setting is off by 0.")
    assert lines[4].endswith(" % in impacts and 2.4 % in resting load.")
    assert lines[5] == of.moving
    assert "412 s of processor time, and 75 s of compiling" in lines[6]
    shaky = tuple(replace(point, beyond=1.99) if point.setting == of.own else point for point in of.points)
    assert summary(replace(of, points=shaky))[4].endswith(", and its step is 1.99 x beyond a bound of stability.")

# SPDX-License-Identifier: Apache-2.0
"""The answer of a study: the cheapest setting that keeps the tolerance and that long runs did not refute."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from facts import missing

from conveyor_sim.accuracy.report.answer import eligible, find_answer, foretelling
from conveyor_sim.accuracy.report.pareto import front
from conveyor_sim.accuracy.results import Comparison, Cost, Errors, Point, Reference, Rest
from conveyor_sim.accuracy.setting import Setting

TICK = 0.01


def errors(peak_force: float) -> Errors:
    return Errors(1e-5, 1e-4, peak_force, peak_force, peak_force)


def point(per_tick: int, error: float, cost: float, integrator: str = "semi_implicit_euler", **more: float) -> Point:
    setting = Setting(integrator, per_tick, **more)
    return Point(setting, TICK / per_tick, None, errors(error), Cost(cost, cost, cost), "")


def failed(per_tick: int) -> Point:
    return Point(Setting("semi_implicit_euler", per_tick), TICK / per_tick, None, None, None, "unstable: at once")


def compared(setting: Setting, verdict: str, low: float = -0.001, high: float = 0.002) -> Comparison:
    return Comparison(setting, "throughput", 8, 100.0, 0.1, 100.0, 0.1, low, high, 0.01, verdict)


COARSE, MIDDLE, FINE = point(10, 0.03, 0.01), point(20, 0.008, 0.02), point(200, 0.0007, 0.18)
VERLET = point(100, 0.0006, 0.064, "velocity_verlet")
SOFT = point(5, 0.001, 0.001, stiffness=0.25)
ALL = [FINE, COARSE, failed(5), MIDDLE, SOFT, VERLET]
SURE = Reference(Setting("dormand_prince", 500, error=1e-9), errors(1e-6))


def test_the_cheapest_that_keeps_the_tolerance() -> None:
    """Failed settings and softer ones are no answers; ten times more exact is the cheapest of a tenth of the error."""
    assert [p.setting for p in eligible(ALL, 0.01)] == [MIDDLE.setting, VERLET.setting, FINE.setting]
    answer = find_answer(ALL, SURE, [], 0.01)
    assert answer is not None
    assert (answer.setting, answer.dt, answer.error) == (MIDDLE.setting, 0.0005, 0.008)
    assert answer.speed == pytest.approx(50.0)
    assert (answer.exacter, answer.exacter_error) == (VERLET.setting, 0.0006)
    assert answer.exacter_cost == pytest.approx(3.2)
    assert missing(answer.sentence, ["Δt = 500 us", "semi_implicit_euler", "0.8 %", "impacts", "50 x real time"]) == []
    assert missing(answer.sentence, ["ten times", "3.2 x", "Δt = 100 us", "velocity_verlet"]) == []


def test_of_settings_that_cost_the_same_the_most_exact() -> None:
    near = point(25, 0.002, 0.02 * 1.04)
    answer = find_answer([*ALL, near], SURE, [], 0.01)
    assert answer is not None
    assert answer.setting == near.setting


def test_what_long_runs_refute_is_not_the_answer() -> None:
    refuted = [compared(MIDDLE.setting, "different", 0.02, 0.03)]
    answer = find_answer(ALL, SURE, [*refuted, compared(VERLET.setting, "equivalent")], 0.01)
    assert answer is not None
    assert (answer.setting, answer.accepted, answer.doubts) == (VERLET.setting, True, ())
    everything = [compared(p.setting, "different", 0.02, 0.03) for p in (MIDDLE, VERLET, FINE)]
    answer = find_answer(ALL, SURE, everything, 0.01)
    assert answer is not None
    assert (answer.setting, answer.accepted) == (FINE.setting, False)
    assert missing(answer.doubts[0], ["every setting", "tolerance", "reference"]) == []


def test_what_is_not_certain_is_said() -> None:
    unsure = Reference(SURE.setting, errors(0.002))
    answer = find_answer(ALL, unsure, [compared(MIDDLE.setting, "undecided", -0.016, 0.012)], 0.01)
    assert answer is not None
    assert not answer.accepted
    assert missing(answer.doubts[0], ["0.2 %", "impacts"]) == []
    assert missing(answer.doubts[1], ["throughput", "1.6 %", "8 runs"]) == []
    bare = find_answer(ALL, SURE, [], 0.01)
    assert bare is not None
    assert "No long runs" in bare.doubts[0]


def test_resting_load_counts_beside_impacts() -> None:
    """Each error has to keep the tolerance; where nothing rests, impacts alone do."""
    crept = [replace(MIDDLE, resting=0.059), replace(VERLET, resting=0.0003), replace(FINE, resting=0.0015)]
    assert [p.setting for p in eligible(crept, 0.01)] == [VERLET.setting, FINE.setting]
    answer = find_answer(crept, SURE, [], 0.01)
    assert answer is not None
    assert (answer.setting, answer.error, answer.resting) == (VERLET.setting, 0.0006, 0.0003)
    assert missing(answer.sentence, ["0.06 % in impacts", "0.03 % in resting load"]) == []


def test_where_nothing_settles_the_prediction_of_resting_load_counts() -> None:
    creeping = [replace(MIDDLE, predicted_resting=0.025), replace(VERLET, predicted_resting=0.0)]
    assert [p.setting for p in eligible(creeping, 0.01)] == [VERLET.setting]
    assert eligible([replace(creeping[0], resting=0.009)], 0.01) != []


def test_a_step_beyond_stability_is_never_recommended() -> None:
    """However exact it was found, and even if nothing else is left."""
    shaky = replace(MIDDLE, beyond=1.99)
    assert [p.setting for p in eligible([shaky, FINE], 0.01)] == [FINE.setting]
    assert find_answer([shaky], SURE, [], 0.01) is None
    assert eligible([replace(MIDDLE, beyond=1.0)], 0.01) == [replace(MIDDLE, beyond=1.0)]


def test_what_is_off_by_more_than_predicted_comes_last() -> None:
    """Measured must be within predicted, in impacts and in resting load, but for the reference's own doubt."""
    wrong = replace(MIDDLE, predicted=0.004)
    right = replace(VERLET, predicted=0.0006, predicted_resting=0.0004, resting=0.0003)
    answer = find_answer([wrong, right], SURE, [], 0.01)
    assert answer is not None and answer.setting == VERLET.setting
    creeps = replace(MIDDLE, predicted=0.009, predicted_resting=0.001, resting=0.002)
    answer = find_answer([creeps, right], SURE, [], 0.01)
    assert answer is not None and answer.setting == VERLET.setting
    rest = Rest("settled at 2 s", VERLET.setting, 0.002, 1.0, 3, 0.2)
    answer = find_answer([creeps, right], SURE, [], 0.01, rest)
    assert answer is not None and answer.setting == MIDDLE.setting
    answer = find_answer([wrong], SURE, [], 0.01)
    assert answer is not None
    assert missing(answer.doubts[0], ["more", "predicted"]) == []


def test_predictions_are_judged_beside_what_was_measured() -> None:
    """Right is from the measured error to twice it."""
    given = replace(MIDDLE, predicted=0.012, predicted_resting=0.05, resting=0.002)
    impacts, resting = foretelling(given).split(";")
    assert missing(impacts, ["Predicted", "1.2 %", "impacts", "0.8 %", "measured", "factor of 2"]) == []
    assert missing(resting, ["5 %", "resting load", "0.2 %", "measured", "25 x"]) == []
    assert "(too little)" in foretelling(replace(MIDDLE, predicted=0.0079))
    assert foretelling(MIDDLE) == ""


def test_no_setting_keeps_the_tolerance() -> None:
    assert find_answer(ALL, SURE, [], 1e-5) is None
    assert eligible([failed(5)], math.inf) == []


def test_impulses_are_measured_and_never_recommended() -> None:
    """Their error in free impacts is that of rounding, and says nothing about forces in a crowd."""
    swept = replace(VERLET, setting=replace(VERLET.setting, integrator="impulses", sweeps=2))
    assert eligible([swept, FINE], 1.0) == [FINE]
    assert front([swept, FINE]) == [FINE]

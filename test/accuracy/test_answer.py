"""The answer of a study: the cheapest setting that keeps the tolerance and that long runs did not refute."""

from __future__ import annotations

import math

import pytest

from conveyor_sim.accuracy.answer import eligible, find_answer
from conveyor_sim.accuracy.results import Comparison, Cost, Errors, Point, Reference
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
    """Failed settings and softer ones are no answers; ten times exacter is the cheapest of a tenth of the error."""
    assert [p.setting for p in eligible(ALL, 0.01)] == [MIDDLE.setting, VERLET.setting, FINE.setting]
    answer = find_answer(ALL, SURE, [], 0.01)
    assert answer is not None
    assert (answer.setting, answer.dt, answer.error) == (MIDDLE.setting, 0.0005, 0.008)
    assert answer.speed == pytest.approx(50.0)
    assert (answer.exacter, answer.exacter_error) == (VERLET.setting, 0.0006)
    assert answer.exacter_cost == pytest.approx(3.2)
    assert answer.sentence == (
        "Δt = 500 us, semi_implicit_euler: 0.8 % in peak force, 50 x real time on this machine; "
        "ten times exacter costs 3.2 x (Δt = 100 us, velocity_verlet)."
    )


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
    assert "tell every setting that keeps the tolerance from the reference" in answer.doubts[0]


def test_what_is_not_certain_is_said() -> None:
    unsure = Reference(SURE.setting, errors(0.002))
    answer = find_answer(ALL, unsure, [compared(MIDDLE.setting, "undecided", -0.016, 0.012)], 0.01)
    assert answer is not None
    assert not answer.accepted
    assert "only sure to 0.2 % in peak force" in answer.doubts[0]
    assert "throughput to 1.6 % (8 runs)" in answer.doubts[1]
    bare = find_answer(ALL, SURE, [], 0.01)
    assert bare is not None
    assert "No long runs" in bare.doubts[0]


def test_no_setting_keeps_the_tolerance() -> None:
    assert find_answer(ALL, SURE, [], 1e-5) is None
    assert eligible([failed(5)], math.inf) == []

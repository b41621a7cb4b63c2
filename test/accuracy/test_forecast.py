# SPDX-License-Identifier: Apache-2.0
"""Predictions for settings before anything runs."""

from __future__ import annotations

import math

import pytest
from facts import missing
from scenes import NO_FLOOR, base, belt, bottle, contact, scene, segment

from conveyor_sim.accuracy.candidates import candidates
from conveyor_sim.accuracy.report.forecast import TRUSTED, forecast, foretold, predicted_error, seconds
from conveyor_sim.accuracy.report.interim import PREDICTED, predicted
from conveyor_sim.accuracy.results import Point
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.physics.model.tick_cost import BESIDE, BOTTLE_STEP, line_size, tick_seconds
from conveyor_sim.scene import Scene


def line() -> Scene:
    """Two bottles on a belt, and a rail across its end."""
    return scene(
        tick=0.01,
        contacts=[contact(5e4), contact(5e4, "steel")],
        base=base(0.3),
        belts={"belt": belt(0.5)},
        rails={"stop": segment((2.0, -1.0), (2.0, 1.0))},
        bottles=[bottle(0.0, 0.0), bottle(0.5, 0.0)],
    )


@pytest.mark.parametrize("tolerance", [0.03, 0.01, 0.001])
def test_the_least_work_that_is_predicted_to_do_within_stability(tolerance: float) -> None:
    it = line()
    chosen = forecast(it, tolerance).point
    assert chosen is not None
    assert predicted_error(chosen) <= tolerance
    assert chosen.beyond is not None and chosen.beyond <= 1.0 + 1e-12
    assert (chosen.errors, chosen.cost) == (None, None)
    for setting in candidates(it):
        if setting.stiffness == 1.0 and setting.integrator in TRUSTED and setting.per_tick < chosen.setting.per_tick:
            other = foretold(it, Point(setting, setting.dt(it), None, None, None, ""))
            assert predicted_error(other) > tolerance or (other.beyond or 0.0) > 1.0


def test_where_nothing_is_predicted_to_do_the_best_is_named() -> None:
    known = forecast(line(), 1e-9)
    assert known.point is None
    assert 1e-9 < known.best < 0.01
    answer = predicted(known)
    assert answer.title == PREDICTED
    assert missing(answer.lines[0], ["Forces", "no setting", "predicted", "1e-7 %", "best"]) == []


def test_each_line_says_that_nothing_has_run() -> None:
    forces, throughput, cost, setting, *_ = predicted(forecast(line(), 0.01)).lines
    assert forces.startswith("Forces: ")
    assert missing(forces, ["predicted", "1 %"]) == []
    assert throughput.startswith("Throughput: not known")
    assert missing(throughput, ["nothing has run"]) == []
    assert missing(cost, ["Cost", "should", "2 bottles", "estimate"]) == []
    assert setting.startswith("Setting: accuracy: {integrator: ")
    assert setting.endswith("(not measured yet)")


def test_cost_goes_as_the_steps_with_a_part_that_ticks_take() -> None:
    it = line()
    one, two = (seconds(it, Setting("leapfrog", steps), 40) for steps in (100, 200))
    assert one == pytest.approx(100 / 0.01 * (40 + BESIDE) * BOTTLE_STEP + tick_seconds(0.0, 40, line_size(it)) / 0.01)
    assert two - one == pytest.approx(100 / 0.01 * (40 + BESIDE) * BOTTLE_STEP)
    assert seconds(it, Setting("rk4", 100), 40) > one


def test_one_bottle_and_no_rail_touch_nothing() -> None:
    known = forecast(scene(contacts=[contact(5e4)], bottles=[bottle(0.0, 0.0, 0.5)], **NO_FLOOR), 0.01)
    assert not known.touches
    assert forecast(line(), 0.01).touches
    assert math.isfinite(known.best)


@pytest.mark.parametrize("stiffness", [500.0, 5e6])
def test_a_soft_scene_is_warned_of_before_it_runs(stiffness: float) -> None:
    """Two bottles of 0.2 kg that meet at 0.5 m/s overlap by 5 % of the diameter at 500 N/m."""
    soft = scene(contacts=[contact(stiffness)], bottles=[bottle(0.0, 0.0, 0.5), bottle(0.5, 0.0)], **NO_FLOOR)
    lines = predicted(forecast(soft, 0.01)).lines
    warnings = [line for line in lines if line.startswith("Warning")]
    assert [missing(line, ["5.4 %", "throughput"]) for line in warnings] == [[]] * (stiffness == 500.0)

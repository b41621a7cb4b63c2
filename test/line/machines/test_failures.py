# SPDX-License-Identifier: Apache-2.0
"""Failures and planned stops: distributions against their closed forms, and the time that counts."""

import math
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from conveyor_sim.line.devices.setup import random_stream
from conveyor_sim.line.machines.failures import LONGEST, Draws, FailureClock, PlannedTimes, weibull_scale
from conveyor_sim.physics.state.snapshot import restore, snapshot
from conveyor_sim.scene.failures import Failure, PlannedStop, Times, Weibull

TICK = 0.01
MANY = 20_000


def draws(fields: dict[str, Any], purpose: str = "jam", tick: float = TICK) -> Draws:
    times: Times = TypeAdapter(Times).validate_python(fields)
    return Draws(times, random_stream(1, "machines/filler", purpose), tick)


def test_exponential_times_have_their_mean_and_no_memory() -> None:
    """Mean and standard deviation are equal, and as many are longer than t + s of those longer than t as are than s."""
    source = draws({"kind": "exponential", "mean": 40.0})
    times = TICK * np.array([source.ticks() for _ in range(MANY)])
    assert times.mean() == pytest.approx(40.0, abs=4 * 40.0 / math.sqrt(MANY))
    # The standard error of the standard deviation of exponential times is sqrt(2/n) of it.
    assert times.std() == pytest.approx(40.0, abs=4 * 40.0 * math.sqrt(2 / MANY))
    for t in (20.0, 60.0):
        share, beyond = np.mean(times[times > t] > t + 30.0), np.exp(-30.0 / 40.0)
        assert share == pytest.approx(beyond, abs=4 * math.sqrt(beyond * (1 - beyond) / (times > t).sum()))


@pytest.mark.parametrize("shape", [0.7, 1.0, 3.0])
def test_weibull_times_have_their_mean_and_survive_as_their_shape_says(shape: float) -> None:
    """P(longer than t) = exp(-(t / scale)^shape)."""
    source = draws({"kind": "weibull", "mean": 40.0, "shape": shape})
    times = TICK * np.array([source.ticks() for _ in range(MANY)])
    assert times.mean() == pytest.approx(40.0, abs=4 * times.std() / math.sqrt(MANY))
    scale = weibull_scale(Weibull(kind="weibull", mean=40.0, shape=shape))
    for t in (10.0, 40.0, 80.0):
        beyond = math.exp(-((t / scale) ** shape))
        assert np.mean(times > t) == pytest.approx(beyond, abs=4 * math.sqrt(beyond * (1 - beyond) / MANY))


def test_a_list_is_taken_in_order_and_again() -> None:
    source = draws({"kind": "list", "times": [1.0, 0.25, 0.004]})
    assert [source.ticks() for _ in range(7)] == [100, 25, 1, 100, 25, 1, 100]


def test_times_without_end_stay_within_what_a_checkpoint_holds() -> None:
    assert draws({"kind": "list", "times": [1e20]}, tick=1e-9).ticks() == LONGEST


def clock(counted: str) -> FailureClock:
    between, repair = {"kind": "list", "times": [0.05, 0.02]}, {"kind": "list", "times": [0.03]}
    failure = Failure.model_validate({"between": between, "repair": repair, "counted": counted})
    return FailureClock(failure, draws(between), draws(repair))


def test_failures_count_running_time_unless_they_are_to_count_the_clock() -> None:
    """Five ticks to the first failure, three down, two to the second; the machine runs in every second tick only."""
    for counted, expected in (("running", [9, 12, 15, 18]), ("clock", [5, 8, 10, 13, 18])):
        jam = clock(counted)
        changes = [tick for tick in range(1, 19) if jam.advance(tick % 2 == 1)]
        assert changes == expected
        assert jam.failed is (len(expected) % 2 == 1)


def test_a_clock_goes_on_from_what_it_remembers() -> None:
    fields = {"between": {"kind": "exponential", "mean": 0.2}, "repair": {"kind": "weibull", "mean": 0.1, "shape": 2.0}}
    failure = Failure.model_validate(fields)
    one, other = (
        FailureClock(failure, draws(fields["between"], "between"), draws(fields["repair"], "repair")) for _ in range(2)
    )
    for _ in range(77):
        one.advance(True)
    restore(other, snapshot(one))
    assert [one.advance(True) for _ in range(500)] == [other.advance(True) for _ in range(500)]


def test_a_planned_stop_comes_once_or_again_and_again() -> None:
    once = PlannedTimes(PlannedStop(start=0.02, duration=0.03), TICK)
    assert [tick for tick in range(30) if once.on(tick)] == [2, 3, 4]
    often = PlannedTimes(PlannedStop(start=0.02, duration=0.03, every=0.1), TICK)
    assert [tick for tick in range(30) if often.on(tick)] == [2, 3, 4, 12, 13, 14, 22, 23, 24]


@pytest.mark.parametrize(("every", "wrong"), [(0.03, 1), (0.031, 0), (None, 0)])
def test_planned_stops_end_before_they_begin_again(every: float | None, wrong: int) -> None:
    stop = PlannedStop(start=0.0, duration=0.03, every=every)
    assert len(list(stop.problems(("machines", "it")))) == wrong

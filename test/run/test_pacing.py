# SPDX-License-Identifier: Apache-2.0
"""Simulated against wall time, with wall times made up."""

import pytest

from conveyor_sim.run.pacing import MAX_LAG, Pacer, RateCap

TICK = 0.01


def test_ticks_are_due_at_the_real_time_factor() -> None:
    pacer = Pacer(2.0, TICK)
    assert pacer.wait(100.0) == 0.0
    pacer.ticked(100.001)
    assert pacer.wait(100.001) == pytest.approx(0.004)
    pacer.ticked(100.006)
    assert pacer.wait(100.006) == pytest.approx(0.004)
    assert pacer.overruns == 0


def test_factor_zero_never_waits_and_never_overruns() -> None:
    pacer = Pacer(0.0, TICK)
    for now in (0.0, 10.0, 10.0):
        assert pacer.wait(now) == 0.0
        pacer.ticked(now)
    assert pacer.overruns == 0


def test_a_late_tick_is_counted_and_caught_up() -> None:
    pacer = Pacer(1.0, TICK)
    pacer.wait(0.0)
    pacer.ticked(0.025)  # due to end by 0.01
    assert pacer.overruns == 1
    assert pacer.wait(0.025) == 0.0
    pacer.ticked(0.026)  # the second one ends after 0.02 as well
    assert pacer.overruns == 2
    pacer.wait(0.026)
    pacer.ticked(0.027)  # the third one is in time again
    assert pacer.overruns == 2
    assert pacer.wait(0.027) == pytest.approx(0.003)
    assert pacer.lost == 0.0


def test_lag_beyond_the_limit_is_given_up_and_told() -> None:
    pacer = Pacer(1.0, TICK)
    pacer.wait(0.0)
    pacer.ticked(1.0)
    assert pacer.overruns == 1
    assert pacer.lost == pytest.approx(1.0 - TICK)
    assert pacer.lost > MAX_LAG
    assert pacer.wait(1.0) == 0.0
    pacer.ticked(1.001)
    assert pacer.wait(1.001) == pytest.approx(TICK - 0.001)


def test_waiting_for_a_controller_is_no_lag() -> None:
    pacer = Pacer(1.0, TICK)
    pacer.wait(0.0)
    pacer.ticked(0.001)
    pacer.catch_breath(5.0)
    assert pacer.wait(5.0) == 0.0
    pacer.ticked(5.001)
    assert pacer.overruns == 0
    assert pacer.lost == 0.0


def test_a_new_factor_counts_from_when_it_is_set() -> None:
    pacer = Pacer(1.0, TICK)
    pacer.wait(0.0)
    pacer.ticked(0.001)
    pacer.factor = 0.1
    assert pacer.wait(3.0) == 0.0
    pacer.ticked(3.001)
    assert pacer.wait(3.001) == pytest.approx(0.099)


def sent_of(cap: RateCap, times: list[float]) -> int:
    count = 0
    for now in times:
        if cap.ready(now):
            cap.sent(now)
            count += 1
    return count


def test_a_cap_lets_through_what_comes_at_its_rate_in_spite_of_jitter() -> None:
    jitter = [0.0, 0.002, -0.003, 0.004, -0.004, 0.001, 0.003, -0.002, 0.0, -0.004]
    times = [0.01 * index + jitter[index % 10] for index in range(1, 1001)]
    assert sent_of(RateCap(100.0), times) == 1000


def test_a_cap_thins_what_comes_faster() -> None:
    times = [0.001 * index for index in range(1, 10_001)]  # 10 s
    assert sent_of(RateCap(100.0), times) == pytest.approx(1000, abs=2)

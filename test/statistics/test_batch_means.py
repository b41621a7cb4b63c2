# SPDX-License-Identifier: Apache-2.0
"""Batch means: coverage on single long runs of a queue, which values taken for independent miss by far."""

import math

import numpy as np
import pytest
from lindley import mean_wait, steady_waits

from conveyor_sim.statistics.batch_means import FEWEST, MOST, batch_means, independent
from conveyor_sim.statistics.intervals import mean_interval

RUNS = 200


@pytest.mark.parametrize(("load", "customers"), [(0.5, 10_000), (0.8, 40_000)])
def test_an_interval_of_one_long_run_covers_the_mean_wait(load: float, customers: int) -> None:
    """At 95 %, but for the 2 % that the choice of the batches costs; each value by itself would give half at most."""
    series = steady_waits(load, RUNS, customers, seed=2)
    found = [result for result in map(batch_means, series) if result is not None]
    assert len(found) >= 0.98 * RUNS
    covered = np.mean([one.interval.low <= mean_wait(load) <= one.interval.high for one in found])
    assert covered >= 0.93 - 3.0 * math.sqrt(0.95 * 0.05 / RUNS)
    plain = [mean_interval(one) for one in series]
    assert np.mean([one.low <= mean_wait(load) <= one.high for one in plain]) < 0.5


def test_batches_are_as_long_as_it_takes() -> None:
    """About a few times as long as a wait has to do with an earlier one: 1 / (1 - sqrt(load))^2 customers."""
    quiet, busy = (batch_means(steady_waits(load, 1, 40_000, seed=3)[0]) for load in (0.3, 0.9))
    assert quiet is not None and busy is not None
    assert quiet.interval.values == MOST and quiet.size == 40_000 // MOST
    assert FEWEST <= busy.interval.values <= MOST and busy.size * busy.interval.values <= 40_000


def test_a_run_too_short_for_its_memory_gets_no_interval() -> None:
    assert batch_means(np.linspace(0.0, 1.0, 10_000)) is None
    assert batch_means(np.arange(5.0)) is None
    short = [batch_means(one) for one in steady_waits(0.95, RUNS, 200, seed=4)]
    assert sum(one is None for one in short) > 0.3 * RUNS


def test_independent_values_pass_as_often_as_the_test_says() -> None:
    values = np.random.default_rng(5).normal(size=(2000, 32))
    assert np.mean([independent(one) for one in values]) == pytest.approx(0.9, abs=3.0 * math.sqrt(0.09 / 2000))
    assert not any(independent(np.cumsum(one)) for one in values[:50])
    assert independent(np.full(20, 3.0))

# SPDX-License-Identifier: Apache-2.0
"""Intervals: their coverage on a queue with a closed form, and their ends against SciPy's own."""

import math

import numpy as np
import pytest
import scipy.stats
from lindley import mean_wait, steady_waits

from conveyor_sim.statistics.intervals import (
    Interval,
    mean_and_variance,
    mean_interval,
    ratio_interval,
    t_probability,
    t_quantile,
)


def sampling(share: float, count: int) -> float:
    """Three standard errors of a share that is seen in so many trials."""
    return 3.0 * math.sqrt(share * (1.0 - share) / count)


@pytest.mark.parametrize("confidence", [0.8, 0.95])
def test_an_interval_covers_the_mean_wait_of_a_queue_as_often_as_it_says(confidence: float) -> None:
    """Ten runs of 1000 customers, 500 times. A wait is skewed, and so its mean over a run is a little: hence 1 %."""
    means = steady_waits(0.5, 5000, 1000, seed=1).mean(axis=1).reshape(500, 10)
    found = [mean_interval(study, confidence) for study in means]
    covered = np.mean([interval.low <= mean_wait(0.5) <= interval.high for interval in found])
    assert covered == pytest.approx(confidence, abs=sampling(confidence, 500) + 0.01)


def test_an_interval_is_that_of_scipy() -> None:
    values = np.random.default_rng(2).normal(3.0, 1.0, 7)
    found = mean_interval(values, 0.9)
    ends = scipy.stats.t.interval(0.9, 6, values.mean(), scipy.stats.sem(values))
    assert (found.low, found.high) == pytest.approx(ends)
    assert found.values == 7 and found.excludes_zero
    chance = scipy.stats.ttest_1samp(values, 2.5)
    assert t_probability(chance.statistic, 6) == pytest.approx(chance.pvalue)
    assert t_quantile(4.5, 0.95) == pytest.approx(scipy.stats.t.ppf(0.975, 4.5))


def test_of_a_single_value_nothing_is_known_but_itself() -> None:
    assert mean_interval([2.0]) == Interval(2.0, math.inf, 1)
    assert not mean_interval([2.0]).excludes_zero
    none = mean_interval([math.nan])
    assert math.isnan(none.mean) and math.isnan(none.half_width) and none.values == 0 and not none.excludes_zero


def test_what_is_not_known_is_left_out() -> None:
    assert mean_interval([1.0, math.nan, 3.0]) == mean_interval([1.0, 3.0])
    assert mean_and_variance(np.array([1.0, math.inf, 3.0])) == (2.0, 1.0)


def test_a_ratio_of_means_is_covered_as_often_as_it_says() -> None:
    random = np.random.default_rng(3)
    values, base = random.normal(12.0, 2.0, (1000, 8)), random.normal(10.0, 3.0, (1000, 12))
    found = [ratio_interval(one, other, 0.9) for one, other in zip(values, base, strict=True)]
    covered = np.mean([ends is not None and ends[0] <= 1.2 <= ends[1] for ends in found])
    assert covered == pytest.approx(0.9, abs=sampling(0.9, 1000))


def test_a_ratio_to_what_may_be_none_has_no_ends() -> None:
    assert ratio_interval(np.array([1.0, 2.0]), np.array([-1.0, 1.1])) is None
    assert ratio_interval(np.array([1.0, 2.0]), np.array([1.0])) is None
    assert ratio_interval(np.array([1.0, math.nan]), np.array([1.0, 2.0])) is None
    assert ratio_interval(np.array([3.0, 3.0]), np.array([2.0, 2.0])) == (1.5, 1.5)

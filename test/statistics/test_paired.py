# SPDX-License-Identifier: Apache-2.0
"""Paired differences: common random numbers tell what two means with seeds of their own do not."""

import math

import numpy as np
import pytest
import scipy.stats
from facts import stating
from lindley import waits

from conveyor_sim.statistics.comparisons import paired_difference, paired_probability, pairing_gain
from conveyor_sim.statistics.intervals import mean_interval, runs_for, runs_to_tell


def test_common_seeds_tell_a_faster_server_with_few_runs() -> None:
    """A server 5 % faster: each run scatters by far more than the difference, but in pairs they scatter alike."""
    slow, fast = (waits(0.5 * faster, 20, 2000, seed=8).mean(axis=1) for faster in (1.0, 1.0 / 1.05))
    paired, gain = paired_difference(slow, fast), pairing_gain(slow, fast)
    assert paired.excludes_zero and paired.mean > 0.0 and gain > 5.0
    others = waits(0.5 / 1.05, 20, 2000, seed=9).mean(axis=1)
    assert not paired_difference(slow, others).excludes_zero
    assert pairing_gain(slow, others) == pytest.approx(1.0, abs=0.6)


def test_its_probability_is_that_of_scipy() -> None:
    one, other = np.random.default_rng(9).normal(size=(2, 12))
    assert paired_probability(one, other) == pytest.approx(scipy.stats.ttest_rel(one, other).pvalue)
    assert paired_probability([1.0, 2.0], [1.0, 2.0]) == 1.0
    assert paired_probability([1.0, 2.0], [0.0, 1.0]) == 0.0
    assert paired_probability([1.0], [0.0]) == 1.0


def test_pairs_are_what_both_have() -> None:
    assert paired_difference([1.0, math.nan, 3.0], [0.0, 1.0, 1.0]) == mean_interval([1.0, 2.0])
    assert math.isnan(pairing_gain([1.0, math.nan], [1.0, 2.0]))
    assert pairing_gain([1.0, 2.0], [2.0, 3.0]) == math.inf
    with pytest.raises(ValueError, match=stating("3 and 2 values", "pairs")):
        paired_difference([1.0, 2.0, 3.0], [1.0, 2.0])


def test_so_many_runs_as_it_says_tell_a_difference_four_times_in_five() -> None:
    random = np.random.default_rng(10)
    pilot = mean_interval(random.normal(0.5, 1.0, 200_000))
    needed = runs_to_tell(type(pilot)(0.5, pilot.half_width, pilot.values))
    assert needed == pilot.values  # there are more than enough
    of_ten = type(pilot)(0.5, 2.262 * 1.0 / math.sqrt(10.0), 10)
    needed = runs_to_tell(of_ten)
    assert needed == pytest.approx((1.96 + 0.84) ** 2 / 0.5**2, rel=0.1)
    told = np.mean([mean_interval(one).excludes_zero for one in random.normal(0.5, 1.0, (2000, needed))])
    assert told == pytest.approx(0.8, abs=3.0 * math.sqrt(0.16 / 2000) + 0.01)


def test_runs_for_a_half_width() -> None:
    found = mean_interval(np.random.default_rng(11).normal(size=10))
    assert runs_for(found, found.half_width * 1.01) == 10
    needed = runs_for(found, found.half_width / 4.0)
    assert needed == pytest.approx(160 * (1.98 / 2.262) ** 2, rel=0.1)
    assert runs_for(found, 0.0) is None and runs_for(mean_interval([1.0]), 1.0) is None

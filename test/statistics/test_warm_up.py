# SPDX-License-Identifier: Apache-2.0
"""Warm-up: the bias of a queue's mean wait is seen, and gone once the rule has left out its start."""

import math

import numpy as np
import pytest
from lindley import mean_wait, steady_waits, waits

from conveyor_sim.statistics.intervals import mean_interval
from conveyor_sim.statistics.warm_up import BATCH, LEAST, warm_up


@pytest.mark.parametrize(("load", "at_start", "customers"), [(0.8, 100.0, 3000), (0.9, 0.0, 1000)])
def test_a_biased_start_is_left_out(load: float, at_start: float, customers: int) -> None:
    """A queue that begins too long, and one that begins empty."""
    found = waits(load, 400, customers, seed=5, at_start=at_start)
    biased = mean_interval(found.mean(axis=1), 0.999)
    assert not biased.low < mean_wait(load) < biased.high
    first = warm_up(found)
    assert first is not None and 0 < first <= customers / 2
    rest = mean_interval(found[:, first:].mean(axis=1), 0.95)
    assert rest.low < mean_wait(load) < rest.high


def test_of_what_is_steady_from_the_start_hardly_anything_is_left_out() -> None:
    series = np.random.default_rng(6).normal(5.0, 1.0, (200, 500))
    assert np.median([warm_up(one) for one in series]) <= 0.1 * 500
    assert warm_up(steady_waits(0.5, 400, 1000, seed=7)) == pytest.approx(0, abs=100)


def test_what_is_steady_is_not_said_to_be_too_short() -> None:
    """Though each value has 0.9 of the one before. Plain MSER-5 refuses a fifth of these."""
    draw = np.random.default_rng(8)
    series = np.empty((400, 200))
    series[:, 0] = draw.normal(size=400) / math.sqrt(1.0 - 0.9**2)
    for place in range(1, 200):
        series[:, place] = 0.9 * series[:, place - 1] + draw.normal(size=400)
    found = [warm_up(one) for one in series]
    assert sum(one is None for one in found) < 0.08 * 400
    filling = [warm_up(one - 10.0 * np.exp(-np.arange(200) / 15.0)) for one in series]
    cut = [one for one in filling if one is not None]
    assert len(cut) > 0.92 * 400 and 15 <= np.median(cut) <= 45


def test_a_step_is_cut_where_it_is() -> None:
    assert warm_up([1.0] * 35 + [2.0, 2.1] * 100) == 35


def test_what_never_settles_is_said_so() -> None:
    for count in (60, 100, 200, 400):
        assert warm_up(np.linspace(0.0, 1.0, count)) is None
    assert warm_up([1.0] * 280 + [2.0, 2.1] * 60) is None


def test_a_short_series_says_nothing() -> None:
    assert warm_up(np.ones(BATCH * LEAST - 1)) is None
    assert warm_up(np.ones(BATCH * LEAST)) == 0
    assert warm_up([1.0] * 80 + [math.nan] + [1.0] * 80) is None

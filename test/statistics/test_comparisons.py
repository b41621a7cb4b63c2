# SPDX-License-Identifier: Apache-2.0
"""Many comparisons: how often one errs where nothing differs, and what is found where something does."""

import math

import numpy as np
import pytest

from conveyor_sim.statistics.comparisons import best, bonferroni, compare_paired, holm, paired_probability

STUDIES, POINTS, SEEDS = 400, 5, 10


def alike(seed: int) -> np.ndarray:
    """Studies of points of one true mean, (studies, points, seeds); a seed lifts all points of a study."""
    random = np.random.default_rng(seed)
    return random.normal(size=(STUDIES, 1, SEEDS)) + 0.3 * random.normal(size=(STUDIES, POINTS, SEEDS))


def test_where_nothing_differs_something_is_told_apart_in_one_study_of_twenty() -> None:
    corrected = np.mean([any(pair.told for pair in compare_paired(list(study))) for study in alike(1)])
    assert corrected <= 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / STUDIES)
    plain = [
        any(paired_probability(study[i], study[j]) < 0.05 for i in range(POINTS) for j in range(i))
        for study in alike(1)
    ]
    assert np.mean(plain) > 0.15


def test_all_intervals_hold_together() -> None:
    offsets = np.arange(POINTS) * 0.1
    held = []
    for study in alike(2) + offsets[:, None]:
        apart = [(pair.interval, offsets[pair.first] - offsets[pair.second]) for pair in compare_paired(list(study))]
        held.append(all(interval.low <= true <= interval.high for interval, true in apart))
    assert np.mean(held) >= 0.95 - 3.0 * math.sqrt(0.05 * 0.95 / STUDIES)


def test_holm_is_as_in_his_example() -> None:
    """Sorted p (n - i) and never less than the one before; up to 1; in the order given."""
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    np.testing.assert_allclose(holm([0.5, 0.9]), [1.0, 1.0])
    assert holm([]).size == 0
    assert bonferroni(0.05, 10) == pytest.approx(0.005)


def test_the_best_is_named_with_all_that_may_be_as_good() -> None:
    random = np.random.default_rng(4)
    common = random.normal(size=12)
    points = [common + mean + 0.1 * random.normal(size=12) for mean in (1.0, 3.0, 2.99, 2.0)]
    assert set(best(points)) == {1, 2}
    assert best(points, highest=False) == [0]
    assert best([common]) == [0]

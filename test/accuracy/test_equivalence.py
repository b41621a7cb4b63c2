# SPDX-License-Identifier: Apache-2.0
"""Acceptance by equivalence: its error rates on processes of known mean and variance, and what can't be compared.

A study is one observable here: two thousand of them are the two thousand observables of the same runs.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from facts import stating

from conveyor_sim.accuracy.measure.equivalence import CONFIDENCE, ERROR_RATE, LOOKS, compare, decide
from conveyor_sim.accuracy.results import Comparison, Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError

REFERENCE = Setting("semi_implicit_euler", 400)
CHEAP = Setting("semi_implicit_euler", 50)
STUDIES = 2000
NAMES = [str(study) for study in range(STUDIES)]
TOLERANCE = 0.05
MEAN = 20.0
SAMPLING = 3.0 * math.sqrt(ERROR_RATE * (1.0 - ERROR_RATE) / STUDIES)
"""Three standard errors of a rate of ERROR_RATE seen in STUDIES."""


def runs(setting: Setting, values: np.ndarray) -> list[Sample]:
    """Samples from values (runs, observables)."""
    return [
        Sample(setting, seed, dict(zip(NAMES, row, strict=False)), 1.0, "") for seed, row in enumerate(values.tolist())
    ]


def studies(difference: float, spread: float, candidate_spread: float, seed: int) -> list[Comparison]:
    """Sequential studies of a true relative difference; spreads are standard deviations over the mean, of one run."""
    random = np.random.default_rng(seed)
    shape = (LOOKS[-1], STUDIES)
    reference = MEAN * (1.0 + spread * random.standard_normal(shape))
    candidate = MEAN * (1.0 + difference) * (1.0 + candidate_spread * random.standard_normal(shape))
    comparisons = decide([*runs(REFERENCE, reference), *runs(CHEAP, candidate)], [CHEAP], REFERENCE, TOLERANCE)
    assert len(comparisons) == STUDIES
    return comparisons


def rate(comparisons: list[Comparison], verdict: str) -> float:
    return sum(comparison.verdict == verdict for comparison in comparisons) / len(comparisons)


@pytest.mark.parametrize(
    ("difference", "spread", "candidate_spread"),
    [(-TOLERANCE, 0.05, 0.05), (TOLERANCE, 0.1, 0.02), (-TOLERANCE, 0.02, 0.1)],
)
def test_a_setting_at_the_tolerance_is_accepted_or_rejected_with_the_stated_rate(
    difference: float, spread: float, candidate_spread: float
) -> None:
    comparisons = studies(difference, spread, candidate_spread, seed=1)
    assert rate(comparisons, "equivalent") <= ERROR_RATE + SAMPLING
    assert rate(comparisons, "different") <= ERROR_RATE + SAMPLING
    # The looks share the rate by Bonferroni, and depend on each other: not much of it is given away all the same.
    assert rate(comparisons, "different") >= 0.2 * ERROR_RATE


def test_the_same_setting_is_accepted_with_power() -> None:
    """Spread and tolerance 5 %: at n runs the interval is +-t sqrt(2 / n) 5 % about what is off by sqrt(2 / n) 5 %.

    That is 3.1 % and 1.25 % at 32 runs, so 88 % of all are accepted by then; 2.2 % and 0.88 % at 64, 99.8 %.
    """
    comparisons = studies(0.0, TOLERANCE, TOLERANCE, seed=2)
    assert rate(comparisons, "equivalent") >= 0.999
    by_32, by_64 = ([row for row in comparisons if row.runs <= runs] for runs in (32, 64))
    assert len(by_32) / STUDIES == pytest.approx(0.88, abs=3.0 * math.sqrt(0.88 * 0.12 / STUDIES))
    assert len(by_64) >= 0.99 * STUDIES
    assert rate(comparisons, "different") <= ERROR_RATE / 10.0


def test_a_setting_past_the_tolerance_is_rejected_with_power() -> None:
    comparisons = studies(2.0 * TOLERANCE, TOLERANCE, TOLERANCE, seed=3)
    assert rate(comparisons, "different") >= 0.999
    assert rate(comparisons, "equivalent") <= ERROR_RATE / 10.0


@pytest.mark.parametrize(("spread", "candidate_spread"), [(0.1, 0.1), (0.3, 0.05), (0.02, 0.3)])
def test_an_interval_covers_the_true_difference(spread: float, candidate_spread: float) -> None:
    """One look at eight runs, the fewest; a normal process, whose mean the reference has to find as well."""
    random = np.random.default_rng(4)
    covered = 0
    for _ in range(STUDIES):
        reference = 3.0 * (1.0 + spread * random.standard_normal(8))
        candidate = 3.0 * 1.2 * (1.0 + candidate_spread * random.standard_normal(8))
        row = compare(CHEAP, "x", candidate.tolist(), reference.tolist(), 0.1)
        covered += row.low <= 0.2 <= row.high
    assert covered / STUDIES == pytest.approx(CONFIDENCE, abs=3.0 * math.sqrt(CONFIDENCE * (1 - CONFIDENCE) / STUDIES))


def test_an_interval_by_hand() -> None:
    """Welch with an exact reference: mean 11 against 10, the standard error of 8 runs 0.1, 7 degrees of freedom."""
    deviation = 0.1 * math.sqrt(7.0)
    candidate = [11.0 + deviation * sign for sign in (1, -1) * 4]
    row = compare(CHEAP, "x", candidate, [10.0] * 8, 0.2)
    assert (row.mean, row.reference, row.runs) == (pytest.approx(11.0), 10.0, 8)
    assert (row.error, row.reference_error) == (pytest.approx(0.1), 0.0)
    t = 3.127552749  # scipy.stats.t.ppf(1 - 0.05 / 6, 7)
    assert row.low == pytest.approx(0.1 - 0.01 * t, rel=1e-6)
    assert row.high == pytest.approx(0.1 + 0.01 * t, rel=1e-6)
    assert row.verdict == "equivalent"
    assert row.resolution == row.high
    assert compare(CHEAP, "x", candidate, [10.0] * 8, row.high * 0.999).verdict == "undecided"
    assert compare(CHEAP, "x", candidate, [10.0] * 8, row.low * 0.999).verdict == "different"


@pytest.mark.parametrize(
    ("candidate", "reference"),
    [
        ([1.0, 1.1], [0.0, 0.0]),  # from nothing to something is no relative difference
        ([1.0, 1.1], [-1.0, 1.2]),  # the reference's mean may be 0
        ([1.0, None], [1.0, 1.0]),
        ([1.0, 1.0], [None, None]),
        ([1.0], [1.0]),
    ],
)
def test_what_can_not_be_compared_is_undecided(candidate: list[float | None], reference: list[float | None]) -> None:
    row = compare(CHEAP, "x", candidate, reference, 0.5)
    assert (row.low, row.high, row.verdict) == (-math.inf, math.inf, "undecided")
    assert row.resolution == math.inf


def test_the_same_number_every_time_is_compared_exactly() -> None:
    assert compare(CHEAP, "x", [0.0] * 8, [0.0] * 8, 0.1).verdict == "equivalent"
    row = compare(CHEAP, "x", [1.05] * 8, [1.0] * 8, 0.1)
    assert (row.low, row.high) == (pytest.approx(0.05), pytest.approx(0.05))


def two_settings(count: int, difference: float) -> list[Sample]:
    random = np.random.default_rng(5)
    noise = random.standard_normal((2, LOOKS[-1], 1))
    reference, cheap = 1.0 + 0.02 * noise[0, :count], (1.0 + difference) * (1.0 + 0.02 * noise[1, :count])
    return [*runs(REFERENCE, reference), *runs(CHEAP, cheap)]


def test_the_first_look_that_decides_stands() -> None:
    """More runs, with any values, do not change it."""
    first = decide(two_settings(16, 0.0), [CHEAP], REFERENCE, TOLERANCE)
    assert [(row.runs, row.verdict) for row in first] == [(8, "equivalent")]
    later = [replace(sample, values={"0": 9.0}) if sample.seed >= 8 else sample for sample in two_settings(64, 0.0)]
    assert decide(later, [CHEAP], REFERENCE, TOLERANCE) == first
    assert decide(later[::-1], [CHEAP], REFERENCE, TOLERANCE) == first


def test_a_look_between_is_the_last() -> None:
    """Eleven runs: looked at after eight and after all."""
    samples = two_settings(11, TOLERANCE)
    (row,) = decide(samples, [CHEAP], REFERENCE, TOLERANCE)
    assert (row.runs, row.verdict) == (11, "undecided")
    assert math.isfinite(row.resolution)
    (row,) = decide(samples[:4] + samples[11:], [CHEAP], REFERENCE, TOLERANCE)
    assert row.runs == 4


def test_settings_that_failed_are_not_judged() -> None:
    samples = two_settings(8, 0.0)
    failed = replace(samples[-1], values={}, failure="unstable")
    assert decide([*samples[:-1], failed], [CHEAP], REFERENCE, TOLERANCE) == []
    broken = replace(samples[2], values={}, failure="unstable")
    with pytest.raises(ConveyorError, match=stating("semi_implicit_euler 400", "failed", "seed 2", "unstable")):
        decide([broken, *samples[3:]], [CHEAP], REFERENCE, TOLERANCE)


def test_settings_are_judged_by_what_a_line_does() -> None:
    """Not by the largest overlap, which a softer contact is meant to change; in the order of the declarations."""
    values = {"spacing": 0.1, "largest overlap": 3.0, "throughput": 60.0}
    samples = [Sample(setting, seed, values, 1.0, "") for setting in (REFERENCE, CHEAP) for seed in range(8)]
    assert [row.observable for row in decide(samples, [CHEAP], REFERENCE, TOLERANCE)] == ["throughput", "spacing"]

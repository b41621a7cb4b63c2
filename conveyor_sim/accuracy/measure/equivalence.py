# SPDX-License-Identifier: Apache-2.0
"""Acceptance by equivalence: a cheaper setting is trusted when its difference from the reference is surely small.

A candidate's observable is accepted when the confidence interval of its relative difference from the reference lies
inside +-tolerance (two one-sided tests, Schuirmann 1987), rejected when it lies outside. To find no significant
difference would not do: few runs never find one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.measure.ensemble import Ensemble, Progress, Run
from conveyor_sim.accuracy.measure.observables import OBSERVABLES
from conveyor_sim.accuracy.results import Comparison, Sample
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.errors import ConveyorError
from conveyor_sim.scene import Scene
from conveyor_sim.statistics.comparisons import bonferroni
from conveyor_sim.statistics.intervals import mean_and_variance, paired_ratio_interval, ratio_interval

LOOKS = (8, 16, 32, 64, 128, 256)
"""Runs of a setting after which the intervals are looked at."""

ERROR_RATE = 0.05
"""Chance to accept an observable whose true difference is the tolerance, over all looks together; and to reject it."""

CONFIDENCE = 1.0 - bonferroni(2.0 * ERROR_RATE, len(LOOKS))
"""Confidence of the interval at one look, by Bonferroni: each look may err at either end by its share of ERROR_RATE."""

_EVERYTHING = (-math.inf, math.inf)


def compare(
    setting: Setting,
    observable: str,
    candidate: Sequence[float | None],
    reference: Sequence[float | None],
    tolerance: float,
    paired: bool = False,
) -> Comparison:
    """One look at an observable: its values (n,) by run under a setting, and (m,) under the reference setting.

    paired: runs of one place have the same seed, so n = m.
    The interval has no ends, and nothing is decided, with fewer than two runs of either, where a run lacks the
    observable (None), or where the reference's mean may as well be 0.
    """
    values, known = _floats(candidate), _floats(reference)
    low, high = _interval(values, known, paired)
    verdict = "undecided"
    if -tolerance < low and high < tolerance:
        verdict = "equivalent"
    elif low > tolerance or high < -tolerance:
        verdict = "different"
    (mean, variance), (reference_mean, reference_variance) = mean_and_variance(values), mean_and_variance(known)
    return Comparison(
        setting=setting,
        observable=observable,
        runs=len(values),
        mean=mean,
        error=math.sqrt(variance),
        reference=reference_mean,
        reference_error=math.sqrt(reference_variance),
        low=low,
        high=high,
        tolerance=tolerance,
        verdict=verdict,
    )


def decide(
    samples: Sequence[Sample],
    settings: Sequence[Setting],
    reference: Setting,
    tolerance: float,
    flow: bool = False,
) -> list[Comparison]:
    """Compare settings with the reference in every observable that is judged, look by look, by seeds in order.

    flow: in counts, rates and positions alone, by which impulses are judged, in pairs of runs with the same seed.

    An observable is looked at after each of LOOKS, and at last with all runs there are; the first look that decides it
    stands. Settings that have no runs, or a run that failed, are left out. ConveyorError if the reference failed.
    """
    runs: dict[Setting, list[Sample]] = {}
    for sample in sorted(samples, key=lambda sample: sample.seed):
        runs.setdefault(sample.setting, []).append(sample)
    known = runs.get(reference, [])
    for sample in known:
        if sample.failure:
            raise ConveyorError(f"the reference, {reference.key}, failed with seed {sample.seed}: {sample.failure}")
    comparisons = []
    for setting in dict.fromkeys(settings):
        own = runs.get(setting, [])
        if not own or not known or any(sample.failure for sample in own):
            continue
        for name in _judged([*own, *known], flow):
            comparisons.append(_sequence(setting, name, own, known, tolerance, flow))
    return comparisons


def run_until_decided(
    scene: Scene,
    settings: Sequence[Setting],
    reference: Setting,
    tolerance: float,
    budget: float,
    folder: Path,
    progress: Progress,
    processes: int | None = None,
    flow: bool = False,
) -> tuple[list[Sample], list[Comparison]]:
    """Make long runs until every observable of every setting is decided, or the budget (s of processor time) is spent.

    The first run of each setting is made in any case and shows what it costs. Then the runs of one look after another
    are made, of the reference and of the settings that are still open; the last look is cut to the runs that the budget
    allows. Time spent is the processor time of the runs, as recorded: other work on the machine does not shorten the
    study, and one that was interrupted is taken up from its folder. Settings with a run that fails get no more.
    Progress has the processor time of all runs of this call, s.

    Raises ConveyorError if the reference fails, or the folder has runs of another scene or version.
    """
    candidates = [setting for setting in dict.fromkeys(settings) if setting != reference]
    samples: list[Sample] = []
    comparisons: list[Comparison] = []
    with Ensemble(scene, folder, processes) as ensemble:
        seeds, active = 0, [reference, *candidates] if candidates else []
        for look in (1, *LOOKS):
            more = look - seeds
            if seeds and active:
                costs = [_mean_cost(samples, setting) for setting in active]
                left = budget - sum(sample.cpu for sample in samples)
                more = min(more, math.floor(left / sum(costs)))
            if not active or more < 1:
                break
            seeds += more
            made = {(sample.setting, sample.seed) for sample in samples}
            new: list[Run] = [(setting, seed) for seed in range(seeds) for setting in active]
            others = sum(sample.cpu for sample in samples if (sample.setting, sample.seed) not in set(new))
            samples += _added(ensemble.run(new, _with_others(progress, others)), made)
            comparisons = decide(samples, candidates, reference, tolerance, flow)
            undecided = {row.setting for row in comparisons if row.verdict == "undecided"}
            active = [reference, *(setting for setting in candidates if setting in undecided)] if undecided else []
            if seeds < look:
                break
    return samples, comparisons


def _with_others(progress: Progress, others: float) -> Progress:
    """Return a progress that adds the processor time of earlier runs, s."""
    return lambda done, whole, spent: progress(done, whole, others + spent)


def _added(samples: Sequence[Sample], made: set[Run]) -> list[Sample]:
    return [sample for sample in samples if (sample.setting, sample.seed) not in made]


def _mean_cost(samples: Sequence[Sample], setting: Setting) -> float:
    return float(np.mean([sample.cpu for sample in samples if sample.setting == setting]))


def _judged(samples: Sequence[Sample], flow: bool) -> list[str]:
    """Observables that any of the runs has, in the order of their declaration, then others."""
    order = [observable.name for observable in OBSERVABLES]
    passed_over = {known.name for known in OBSERVABLES if not (known.flow if flow else known.judged)}
    names = dict.fromkeys(name for sample in samples for name in sample.values if name not in passed_over)
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def _sequence(
    setting: Setting, name: str, own: Sequence[Sample], known: Sequence[Sample], tolerance: float, paired: bool
) -> Comparison:
    """Return the first look that decides, or else the last."""
    candidate = [sample.values.get(name) for sample in own]
    reference = [sample.values.get(name) for sample in known]
    most = min(len(own), len(known))
    for runs in (*(look for look in LOOKS if look < most), most):
        comparison = compare(setting, name, candidate[:runs], reference[:runs], tolerance, paired)
        if comparison.verdict != "undecided":
            break
    return comparison


def _floats(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


def _interval(candidate: NDArray[np.float64], reference: NDArray[np.float64], paired: bool) -> tuple[float, float]:
    """Confidence interval of the ratio of two means, less 1; the mean of the reference is not taken for exact."""
    if min(len(candidate), len(reference)) > 1 and not candidate.any() and not reference.any():
        return 0.0, 0.0  # nothing happened in any run of either
    found = (paired_ratio_interval if paired else ratio_interval)(candidate, reference, CONFIDENCE)
    return _EVERYTHING if found is None else (found[0] - 1.0, found[1] - 1.0)

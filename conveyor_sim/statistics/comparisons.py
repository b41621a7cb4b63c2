"""Many comparisons at once: of twenty pairs that are alike, one differs at 95 % by chance, if nothing corrects it.

Points that ran with the same seeds are compared in pairs of runs: intervals by Bonferroni, which hold all together with
the stated confidence, and the verdict by Holm (1979), which finds more and errs no more often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.intervals import CONFIDENCE, Interval
from conveyor_sim.statistics.paired import paired_difference, paired_probability


@dataclass(frozen=True)
class Difference:
    """One point less another."""

    first: int
    second: int
    """Places in the order given."""
    interval: Interval
    """All intervals of a comparison hold together with its confidence."""
    probability: float
    """Chance to see such a difference somewhere among all, were there none (p-value, corrected)."""
    told: bool
    """Whether they can be told apart."""


def bonferroni(level: float, count: int) -> float:
    """Chance to err that each of so many verdicts may have, for a chance of `level` that any of them errs."""
    return level / count


def holm(probabilities: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """P-values (n,) corrected for being so many: whichever are below a level, all are right with 1 - that level."""
    given = np.asarray(probabilities, dtype=np.float64)
    order = np.argsort(given, kind="stable")
    corrected = np.empty_like(given)
    corrected[order] = np.minimum(np.maximum.accumulate(given[order] * (len(given) - np.arange(len(given)))), 1.0)
    return corrected


def compare_paired(points: Sequence[NDArray[np.float64]], confidence: float = CONFIDENCE) -> list[Difference]:
    """Every point (n,) with every later one, by seed in the same order. Raises ValueError for unequal lengths."""
    pairs = list(combinations(range(len(points)), 2))
    each = 1.0 - bonferroni(1.0 - confidence, max(1, len(pairs)))
    chances = holm([paired_probability(points[one], points[other]) for one, other in pairs])
    return [
        Difference(one, other, paired_difference(points[one], points[other], each), float(chance), bool(told))
        for (one, other), chance, told in zip(pairs, chances, chances < 1.0 - confidence, strict=True)
    ]


def best(points: Sequence[NDArray[np.float64]], highest: bool = True, confidence: float = CONFIDENCE) -> list[int]:
    """Places of the point with the best mean, first, and of all that can't be told from it, in their order."""
    means = np.array([np.nanmean(values) for values in points])
    top = int(np.argmax(means) if highest else np.argmin(means))
    told = [pair for pair in compare_paired(points, confidence) if pair.told and top in (pair.first, pair.second)]
    worse = {pair.second if pair.first == top else pair.first for pair in told}
    return [top, *(place for place in range(len(points)) if place != top and place not in worse)]

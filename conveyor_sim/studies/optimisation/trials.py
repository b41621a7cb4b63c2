# SPDX-License-Identifier: Apache-2.0
"""Trials of an optimisation, and the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.statistics.comparisons import best
from conveyor_sim.studies.optimisation.objective import Objective
from conveyor_sim.studies.row import RunRow


@dataclass(frozen=True)
class Trial:
    """A point, run with some seeds."""

    number: int
    parameters: Mapping[str, Any]
    rows: tuple[RunRow, ...]
    """By seed, in order."""

    @property
    def failure(self) -> str:
        """Why the first run failed that did; "": none has."""
        return next((row.error or row.status for row in self.rows if row.status != "finished"), "")

    @cached_property
    def means(self) -> dict[str, float] | None:
        """Return the mean of each metric over the seeds, NaN without values; None: a run failed."""
        if self.failure:
            return None
        return {name: float(np.mean(self.values(name))) for name in self.rows[0].metrics}

    def values(self, metric: str) -> NDArray[np.float64]:
        """Return the values of a metric by seed, (seeds,)."""
        return np.array([row.metrics[metric] for row in self.rows], dtype=np.float64)


def feasible(trials: Sequence[Trial], objective: Objective) -> list[Trial]:
    """Return the trials without failed runs that meet all constraints."""
    return [trial for trial in trials if trial.means is not None and objective.feasible(trial.means)]


def front(trials: Sequence[Trial], objective: Objective) -> list[Trial]:
    """Return the non-dominated trials, ordered by the first goal from worse to better; of equal trials the first.

    With one goal, that is the best trial.
    """
    candidates = [(trial, trial.means) for trial in feasible(trials, objective) if trial.means is not None]
    found: list[tuple[Trial, dict[str, float]]] = []
    names = [goal.metric for goal in objective.goals]
    for trial, means in candidates:
        again = any(all(means[name] == other[name] for name in names) for _, other in found)
        if not again and not any(objective.dominates(other, means) for _, other in candidates):
            found.append((trial, means))
    sign = 1.0 if objective.goals[0].maximise else -1.0
    return [trial for trial, _ in sorted(found, key=lambda pair: sign * pair[1][names[0]])]


def as_good(trials: Sequence[Trial], objective: Objective) -> list[Trial]:
    """Return the best feasible trial of one goal, then all that don't differ significantly from it."""
    kept = feasible(trials, objective)
    if not kept:
        return []
    goal = objective.goals[0]
    return [kept[place] for place in best([trial.values(goal.metric) for trial in kept], goal.maximise)]

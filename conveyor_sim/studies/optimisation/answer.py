# SPDX-License-Identifier: Apache-2.0
"""Result of an optimisation, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from conveyor_sim.statistics.comparisons import paired_difference
from conveyor_sim.statistics.intervals import mean_interval
from conveyor_sim.statistics.words import plus_minus, told
from conveyor_sim.studies.figures.data import TrialsData
from conveyor_sim.studies.optimisation.objective import Constraint, Objective
from conveyor_sim.studies.optimisation.optimise import Optimum
from conveyor_sim.studies.optimisation.trials import Trial, feasible
from conveyor_sim.studies.row import point_text

Units = Mapping[str, str]
"""Units of metrics by name; "1" or "": dimensionless."""


def answer(optimum: Optimum, units: Units) -> Iterator[str]:
    """Line by line."""
    objective, trials = optimum.objective, optimum.trials
    kept, failed = feasible(trials, objective), [trial for trial in trials if trial.failure]
    if failed:
        yield f"{len(failed)} of {len(trials)} points have a run that failed; the first: {failed[0].failure}"
    if not kept:
        bounds = " and ".join(map(str, objective.constraints)) or "every run finished"
        yield f"no point of {len(trials)} was found for which {bounds}"
    elif len(objective.goals) > 1:
        yield f"{len(optimum.front)} of {len(trials)} points are such that no other is better in both goals:"
        for trial in optimum.front:
            yield f"  {_point(trial)}: {_metrics(trial, objective, units)}"
    else:
        yield from _best(optimum, units)


def trials_data(name: str, optimum: Optimum, units: Units) -> TrialsData:
    """Return the result as data of a figure. name: of the study."""
    objective, trials = optimum.objective, optimum.trials
    metrics = [goal.metric for goal in objective.goals]
    found = [[mean_interval([] if trial.failure else trial.values(metric)) for metric in metrics] for trial in trials]
    kept = {trial.number for trial in feasible(trials, objective)}
    return TrialsData(
        name=name,
        objective=str(objective),
        labels=tuple(f"{metric} ({unit})" if (unit := _unit(units, metric)) else metric for metric in metrics),
        means=np.array([[interval.mean for interval in row] for row in found]),
        half_widths=np.array([[interval.half_width for interval in row] for row in found]),
        kept=np.array([trial.number in kept for trial in trials]),
        front=tuple(trial.number for trial in optimum.front),
        maximise=objective.goals[0].maximise,
        started=optimum.started,
    )


def _best(optimum: Optimum, units: Units) -> Iterator[str]:
    objective, trials, best = optimum.objective, optimum.trials, optimum.front[0]
    others = len(optimum.as_good) - 1
    is_start = ", the start" if optimum.started and best.number == 0 else ""
    yield f"best of {len(trials)} points: {_point(best)}{is_start}"
    yield f"  {_metrics(best, objective, units)} ({_seeds(best)})"
    if others:
        kept = len(feasible(trials, objective))
        yield f"  {others} of the {kept} points that keep all bounds can't be told from it with {_seeds(best)}"
    fresh, *start = optimum.fresh
    if fresh.failure:
        yield f"with fresh seeds, a run of it failed: {fresh.failure}"
        return
    yield f"with {_seeds(fresh)} that no trial had (the best of many owes a part of its place to its seeds):"
    yield f"  best: {_metrics(fresh, objective, units)}"
    for constraint in objective.constraints:
        yield f"  {constraint} {_kept(constraint, fresh)}"
    if not start:
        return
    if start[0].failure:
        yield f"  start: a run of it failed: {start[0].failure}"
        return
    yield f"  start: {_metrics(start[0], objective, units)}"
    metric = objective.goals[0].metric
    apart = paired_difference(fresh.values(metric), start[0].values(metric))
    yield f"  {metric}: {told(apart, 'best', 'start', _unit(units, metric))}"


def _kept(constraint: Constraint, trial: Trial) -> str:
    """Return text on a constraint: number of runs that meet it, and significance for the mean, which it bounds."""
    values = trial.values(constraint.metric)
    keeps = sum(constraint.violation(value) <= 0.0 for value in values.tolist())
    runs = f"in {keeps} of {len(values)} runs"
    interval = mean_interval(values)
    ends = [constraint.violation(end) <= 0.0 for end in (interval.low, interval.high)]
    if all(ends):
        return f"on average, and {runs}"
    return f"{runs}; on average " + ("it can't be told" if any(ends) else "not")


def _point(trial: Trial) -> str:
    return f"point {trial.number} ({point_text(trial.parameters)})"


def _seeds(trial: Trial) -> str:
    return f"{len(trial.rows)} seed{'' if len(trial.rows) == 1 else 's'}"


def _metrics(trial: Trial, objective: Objective, units: Units) -> str:
    """Return text with the metrics of goals and constraints, each with its interval over the seeds."""
    metrics = [goal.metric for goal in objective.goals] + [bound.metric for bound in objective.constraints]
    shown = (
        f"{metric} {plus_minus(mean_interval(trial.values(metric)), _unit(units, metric))}"
        for metric in dict.fromkeys(metrics)
    )
    return ", ".join(shown)


def _unit(units: Units, metric: str) -> str:
    return "" if units.get(metric, "") == "1" else units.get(metric, "")

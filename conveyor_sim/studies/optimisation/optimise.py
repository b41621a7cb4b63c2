# SPDX-License-Identifier: Apache-2.0
"""An optimisation from its first trial to the comparison of its best point with the start on fresh seeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.optimisation.objective import Objective, parse_objective
from conveyor_sim.studies.optimisation.part import Optimise
from conveyor_sim.studies.optimisation.search import Search
from conveyor_sim.studies.optimisation.trials import Trial, as_good, front
from conveyor_sim.studies.row import Job, RunRow
from conveyor_sim.studies.runs import Progress, Runs
from conveyor_sim.studies.setup import Setup


@dataclass(frozen=True)
class Optimum:
    """Result of an optimisation."""

    objective: Objective
    trials: tuple[Trial, ...]
    front: tuple[Trial, ...]
    """The best trial; with two goals, those that no other is better than. Empty: none keeps all bounds."""
    as_good: tuple[Trial, ...]
    """With one goal: the best trial and all that can't be told from it."""
    started: bool
    """True if trial 0 is the start point."""
    fresh: tuple[Trial, ...]
    """With one goal: the best point, and behind it the start if it is another, as run with fresh seeds."""


def optimise(runs: Runs, setup: Setup, progress: Progress = lambda *_: None) -> Optimum:
    """Try points, one batch after the other, then run the best one and the start with seeds that no trial had.

    Which points are tried follows from the study and the results of earlier batches alone, so an optimisation that was
    interrupted goes on where it was, and one of more trials goes on from one of fewer. progress: as for `Runs.run`.
    Raises StudyError as `Runs.run`, and for a study that has nothing to optimise; ConveyorError where Optuna is not
    installed.
    """
    study, wanted, seeds = setup.study, wanted_of(setup), setup.study.seeds
    assert seeds.count is not None  # another one beside optimise is refused
    objective = parse_objective(wanted.objective, study.metrics)
    search = Search(study.parameters, objective, wanted.start, wanted.sampler_seed)
    used = range(seeds.first, seeds.first + seeds.count)
    total = wanted.trials * len(used)
    trials: list[Trial] = []
    while len(trials) < wanted.trials:
        # A batch is whole even where it is the last one and cut: with more trials it is gone on with.
        points = search.ask(wanted.batch)[: wanted.trials - len(trials)]
        new = [Trial(len(trials) + place, point, ()) for place, point in enumerate(points)]
        made = _run(runs, new, used, _in_all(progress, len(trials) * len(used), total))
        trials += made
        if len(made) == wanted.batch:
            search.tell([trial.means for trial in made])
    best, started = front(trials, objective), wanted.start is not None
    if len(objective.goals) > 1 or not best:
        return Optimum(objective, tuple(trials), tuple(best), (), started, ())
    compared = [best[0], *([trials[0]] if started and best[0].number else [])]
    fresh = _run(runs, compared, range(used.stop, used.stop + wanted.fresh_seeds), progress)
    return Optimum(objective, tuple(trials), tuple(best), tuple(as_good(trials, objective)), started, tuple(fresh))


def _in_all(progress: Progress, before: int, total: int) -> Progress:
    """Progress of a batch as that of all runs of the trials."""

    def reported(done: int, whole: int, left: float | None, row: RunRow | None) -> None:
        all_left = None if left is None or done == whole else left * (total - before - done) / (whole - done)
        progress(before + done, total, all_left, row)

    return reported


def wanted_of(setup: Setup) -> Optimise:
    """Return the optimisation part of a study. Raise StudyError if there is nothing to optimise."""
    if setup.study.optimise is None:
        raise StudyError(f"{setup.path}: optimise: missing, expected an objective and how many trials")
    return setup.study.optimise


def _run(runs: Runs, trials: list[Trial], seeds: range, progress: Progress) -> list[Trial]:
    """Run the trials' points with these seeds."""
    rows = runs.run([Job(trial.number, trial.parameters, seed) for trial in trials for seed in seeds], progress)
    size = len(seeds)
    return [replace(trial, rows=tuple(rows[i * size : (i + 1) * size])) for i, trial in enumerate(trials)]

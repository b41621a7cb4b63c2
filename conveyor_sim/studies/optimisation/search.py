# SPDX-License-Identifier: Apache-2.0
"""Optuna, asked for points and told what came of them, in the order of the trials.

Its tree-structured Parzen estimator (Bergstra et al. 2011) with bounds and for several goals (Watanabe 2023), seeded.
It keeps nothing on disk: who goes on with a study asks for the same points again, and has their runs at hand.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from conveyor_sim.errors import ConveyorError
from conveyor_sim.studies.optimisation.objective import Objective
from conveyor_sim.studies.parameter import Parameter

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution
    from optuna.trial import FrozenTrial

_VIOLATIONS = "violations"


class Search:
    """Search strategy: proposes the points to try."""

    def __init__(
        self, parameters: Mapping[str, Parameter], objective: Objective, start: Mapping[str, Any] | None, seed: int
    ) -> None:
        """start: the first point, if given. Raises ConveyorError where Optuna is not installed."""
        require_optuna()
        import optuna
        from optuna.exceptions import ExperimentalWarning

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._objective = objective
        self._distributions = {name: _distribution(parameter) for name, parameter in parameters.items()}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExperimentalWarning)
            sampler = optuna.samplers.TPESampler(
                seed=seed,
                multivariate=True,
                constant_liar=True,  # points of a batch keep away from each other
                constraints_func=_violations if objective.constraints else None,
            )
        directions = ["maximize" if goal.maximise else "minimize" for goal in objective.goals]
        self._study = optuna.create_study(sampler=sampler, directions=directions)
        self._asked: list[optuna.Trial] = []
        if start is not None:
            self._study.enqueue_trial(dict(start))

    def ask(self, count: int) -> list[dict[str, Any]]:
        """Return `count` points to try, based on the reported metrics."""
        asked = [self._study.ask(self._distributions) for _ in range(count)]
        self._asked += asked
        return [dict(trial.params) for trial in asked]

    def tell(self, outcomes: Sequence[Mapping[str, float] | None]) -> None:
        """Report the metrics of all proposed points; None: a run failed."""
        from optuna.trial import TrialState

        for trial, metrics in zip(self._asked, outcomes, strict=True):
            goals = [] if metrics is None else [metrics[goal.metric] for goal in self._objective.goals]
            if metrics is None or any(value != value for value in goals):
                self._study.tell(trial, state=TrialState.FAIL)
            else:
                trial.set_user_attr(_VIOLATIONS, self._objective.violations(metrics))
                self._study.tell(trial, goals)
        self._asked = []


def require_optuna() -> None:
    """Raise ConveyorError if Optuna isn't installed."""
    if find_spec("optuna") is None:
        raise ConveyorError("optimise: optuna is not installed, expected it (pip install 'conveyor_sim[optimise]')")


def _violations(trial: FrozenTrial) -> Sequence[float]:
    violations: list[float] = trial.user_attrs[_VIOLATIONS]
    return violations


def _distribution(parameter: Parameter) -> BaseDistribution:
    from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

    if parameter.values is not None:
        return CategoricalDistribution(parameter.values)
    assert parameter.low is not None and parameter.high is not None  # a study without both is refused
    if parameter.whole:
        return IntDistribution(round(parameter.low), round(parameter.high), log=parameter.log)
    return FloatDistribution(parameter.low, parameter.high, log=parameter.log)

# SPDX-License-Identifier: Apache-2.0
"""Objective of an optimisation as one line: `maximise efficiency subject to peak_force < 40`.

    maximise|minimise METRIC [and maximise|minimise METRIC] [subject to METRIC <|<=|>|>= NUMBER [and ...]]

A METRIC is a name of the study. Its mean over the seeds of a trial counts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NoReturn

from conveyor_sim.errors import StudyError
from conveyor_sim.scene.words import listed, shown

_WORD = re.compile(r"<=|>=|<|>|[^\s<>=]+|\S")
_SAY = "maximise <metric> [and minimise <metric>] [subject to <metric> < <number> [and ...]]"
_MAXIMISE = {"maximise": True, "maximize": True, "minimise": False, "minimize": False}
_SIGNS = {"<": -1.0, "<=": -1.0, ">": 1.0, ">=": 1.0}


@dataclass(frozen=True)
class Goal:
    """A metric that shall be as high, or as low, as can be."""

    metric: str
    maximise: bool


@dataclass(frozen=True)
class Constraint:
    """A bound that a metric must keep."""

    metric: str
    relation: str
    """<, <=, > or >=."""
    limit: float

    def violation(self, value: float) -> float:
        """0 or less where a value keeps it, and the more above 0 the further it is off; infinite for NaN."""
        if math.isnan(value):
            return math.inf
        apart = _SIGNS[self.relation] * (self.limit - value)
        return math.ulp(self.limit) if apart == 0.0 and "=" not in self.relation else apart

    def __str__(self) -> str:
        return f"{self.metric} {self.relation} {self.limit:g}"


@dataclass(frozen=True)
class Objective:
    """One goal or two, and bounds."""

    goals: tuple[Goal, ...]
    constraints: tuple[Constraint, ...]

    def __str__(self) -> str:
        goals = " and ".join(f"{'maximise' if goal.maximise else 'minimise'} {goal.metric}" for goal in self.goals)
        return goals + (f" subject to {' and '.join(map(str, self.constraints))}" if self.constraints else "")

    def violations(self, metrics: Mapping[str, float]) -> list[float]:
        """Return the violation of each constraint."""
        return [constraint.violation(metrics[constraint.metric]) for constraint in self.constraints]

    def feasible(self, metrics: Mapping[str, float]) -> bool:
        """Return True if each goal has a value and all constraints are met."""
        known = all(math.isfinite(metrics[goal.metric]) for goal in self.goals)
        return known and all(violation <= 0.0 for violation in self.violations(metrics))

    def dominates(self, one: Mapping[str, float], other: Mapping[str, float]) -> bool:
        """Return True if `one` is better in one goal and worse in none."""
        signs = [1.0 if goal.maximise else -1.0 for goal in self.goals]
        gains = [sign * (one[goal.metric] - other[goal.metric]) for sign, goal in zip(signs, self.goals, strict=True)]
        return min(gains) >= 0.0 and max(gains) > 0.0


def parse_objective(text: str, metrics: Iterable[str]) -> Objective:
    """Read an objective over metrics of these names. Raises StudyError, in a sentence, for anything else."""
    reader = _Reader(text, tuple(metrics))
    goals = [reader.goal()]
    while reader.takes("and"):
        goals.append(reader.goal())
    constraints = []
    if reader.takes("subject"):
        reader.expect("to", "subject to")
        constraints.append(reader.constraint())
        while reader.takes("and"):
            constraints.append(reader.constraint())
    reader.end()
    if len(goals) > 2:
        raise StudyError(f"{shown(text)} given, expected one metric to optimise, or two")
    if len({goal.metric for goal in goals}) < len(goals):
        raise StudyError(f"{shown(text)} given, expected two different metrics to optimise")
    return Objective(tuple(goals), tuple(constraints))


class _Reader:
    """Word by word."""

    def __init__(self, text: str, metrics: tuple[str, ...]) -> None:
        self._text, self._metrics = text, metrics
        self._words: list[str] = _WORD.findall(text)

    def takes(self, word: str) -> bool:
        """Consume `word` if it comes next; return True if it did."""
        if self._words[:1] != [word]:
            return False
        self._next()
        return True

    def expect(self, word: str, what: str) -> None:
        """Read a word that must be there."""
        if not self.takes(word):
            self._refuse(what)

    def goal(self) -> Goal:
        """Parse maximise or minimise, and a metric."""
        if not self._words or self._words[0] not in _MAXIMISE:
            self._refuse("maximise or minimise")
        return Goal(maximise=_MAXIMISE[self._next()], metric=self._metric())

    def constraint(self) -> Constraint:
        """Parse a metric, a relation and a number."""
        metric = self._metric()
        if not self._words or self._words[0] not in _SIGNS:
            self._refuse(f"{listed(list(_SIGNS))} behind {metric}")
        relation = self._next()
        try:
            limit = float(self._words[0]) if self._words else math.nan
        except ValueError:
            limit = math.nan
        if not math.isfinite(limit):
            self._refuse(f"a number behind {metric} {relation}")
        self._next()
        return Constraint(metric, relation, limit)

    def end(self) -> None:
        """Nothing must be left."""
        if self._words:
            self._refuse("and, subject to, or the end")

    def _metric(self) -> str:
        if not self._words or self._words[0] not in self._metrics:
            self._refuse(f"a metric of the study: {listed(list(self._metrics))}")
        return self._next()

    def _next(self) -> str:
        return self._words.pop(0)

    def _refuse(self, expected: str) -> NoReturn:
        found = shown(self._words[0]) if self._words else "the end"
        raise StudyError(f"{shown(self._text)}: found {found}, expected {expected}; an objective is {_SAY}")

# SPDX-License-Identifier: Apache-2.0
"""A study as its YAML file says it: what varies, how often each point is run, what is asked of a run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Len, Lt
from pydantic import BeforeValidator, Strict

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.types import (
    Count,
    Flag,
    Holds,
    Name,
    NotNegative,
    Positive,
    Says,
    Seed,
    Text,
    quantity,
)
from conveyor_sim.scene.words import shown
from conveyor_sim.studies.optimisation.part import Optimise
from conveyor_sim.studies.parameter import Parameter

LAST_SEED = 2**64 - 1
LEAST_BATCH = 10
"""Runs of a point, at least, before it is asked whether there are enough: of fewer the spread is hardly known."""

MSER = "mser"
"""In place of the seconds of a warm-up: pilot runs find it."""

HALF_WIDTH = "_half_width"
"""Behind the name of a metric: the column beside it that says how well the run alone knows it."""

MOST_RUNS = 1_000_000
"""Most runs of a study; each is one file."""

RESERVED = ("point", "seed", "status", "error", "simulated", "dt", "wall", "cpu", "bag")
"""Columns that every table of runs has."""

Design = Literal["grid", "list", "latin_hypercube", "sobol", "saltelli"]

_Batch = Annotated[int, Strict(), Ge(LEAST_BATCH), Says(f"a whole number, {LEAST_BATCH} or greater")]
_WarmUp = Annotated[NotNegative | Literal["mser"], Says('a number, 0 or greater, or "mser"')]
_Confidence = Annotated[float, Strict(), Gt(0), Lt(1), Says("a number between 0 and 1")]


class Until(Part):
    """Stopping rule: ends the runs of a point at a given interval width."""

    metric: Text = quantity("Name of the metric.")
    half_width: Positive = quantity("Half width of the confidence interval of its mean, in its unit.")
    relative: Flag = quantity("Whether the half width is a share of the mean.", default=False)
    confidence: _Confidence = quantity("Of the interval.", "1", default=0.95)


class Seeds(Part):
    """The seeds of each point: the same for all points, so that differences between points are paired."""

    count: Count | None = quantity("Runs of each point. Left out: as many as `until` takes.", "1", default=None)
    first: Seed = quantity("The first one; those that follow it are used in order.", "1", default=1)
    until: Annotated[Until, Holds("a mapping with the fields " + ", ".join(Until.model_fields))] | None = quantity(
        "In batches, until the interval is narrow enough.", default=None
    )
    batch: _Batch = quantity("Runs of a point between two looks at the interval.", "1", default=LEAST_BATCH)
    most: Count = quantity("Runs of a point at most, with `until`.", "1", default=200)

    def problems(self, path: tuple[str, ...]) -> Iterator[Problem]:
        """Yield the problems of this part by itself."""
        if (self.count is None) == (self.until is None):
            yield Problem(path, "expected either count or until")
        if self.until is not None and self.most < self.batch:
            text = f"{shown(self.most)} given, expected at least the batch, {self.batch}"
            yield Problem((*path, "most"), text)
        last = self.first + (self.most if self.count is None else self.count) - 1
        if last > LAST_SEED:
            yield Problem((*path, "first"), f"{self.first} given, expected one with which the last is at most 2^64 - 1")


def _counted(value: Any) -> Any:
    return {"count": value} if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def _named(value: Any) -> Any:
    """Metrics as a mapping from names, of a list of names and of mappings with one of them each."""
    if not isinstance(value, (list, tuple)):
        return value
    pairs: list[tuple[Any, Any]] = []
    for one in value:
        pairs += one.items() if isinstance(one, Mapping) else [(one, one)]
    names = [name for name, _ in pairs]
    if len(set(map(str, names))) < len(names):
        raise ValueError("given twice")
    return dict(pairs)


def _repeated(values: Sequence[Any]) -> Iterator[int]:
    """Places of those that stand before, too. True is not 1."""
    seen: set[Any] = set()
    for place, value in enumerate(values):
        one = tuple((isinstance(part, bool), part) for part in (value if isinstance(value, tuple) else (value,)))
        if one in seen:
            yield place
        seen.add(one)


def _is_reserved(name: str) -> bool:
    return name in RESERVED or name.endswith(HALF_WIDTH)


_METRICS = (
    "a list of metrics, each a name such as efficiency, or a mapping of a name of yours to one metric, such as "
    "queue: mean zones/table/bottles; each name once"
)


class Study(Part):
    """A scene, or a function that returns one, asked many questions."""

    name: Name = quantity("Name of the study.")
    description: Text = quantity("What it asks.", default="")
    scene: Text | None = quantity(
        "Scene file, from the folder of the study, or the name of a shipped one.", default=None
    )
    function: Text | None = quantity("`file.py:function` or `module:function` that returns a Scene.", default=None)
    arguments: Annotated[dict[str, Any], Holds("a mapping of arguments to values")] = quantity(
        "Of the function, beside those that vary.", default={}
    )
    overrides: Annotated[dict[str, Any], Holds("a mapping of fields of the scene")] = quantity(
        "Laid over the scene in every run.", default={}
    )
    controller: Text | None = quantity(
        "`program.st`, `file.py:factory` or `module:factory`; it scans at every tick.", default=None
    )
    settings: Annotated[dict[str, Any], Holds("a mapping of parameters to values")] = quantity(
        "Parameters of the factory, beside those that vary.", default={}
    )
    duration: Positive | None = quantity("Of each run. Left out: the scene's.", "s", default=None)
    warm_up: _WarmUp = quantity(
        "At the start of each run, which metrics leave out; mser: as long as rule MSER-5 says, by pilot runs.",
        "s",
        default=0.0,
    )
    warm_start: Positive | None = quantity(
        "Duration of a run made once per seed, with the controller as in `settings`. Every run begins at its end. "
        "For studies in which only the controller varies.",
        "s",
        default=None,
    )
    parameters: Annotated[dict[Name, Parameter], Len(1), Holds("a mapping of names to parameters, at least one")] = (
        quantity("What varies.")
    )
    design: Annotated[Design, Says('"grid", "list", "latin_hypercube", "sobol" or "saltelli"')] = quantity(
        "Which points: grid: all combinations of values; list: the first values of all, the second ones, ...; "
        "latin_hypercube, sobol: spread over ranges; saltelli: as Sobol indices need them.",
        default="grid",
    )
    points: Count | None = quantity(
        "How many, of the last three designs; of saltelli the base sample.", "1", default=None
    )
    design_seed: Seed = quantity("Seed of designs that are drawn.", "1", default=0)
    seeds: Annotated[
        Seeds,
        BeforeValidator(_counted),
        Holds("a whole number, 1 or greater, or a mapping with the fields " + ", ".join(Seeds.model_fields)),
    ] = quantity("How often each point is run.")
    metrics: Annotated[dict[Name, Text], Len(1), BeforeValidator(_named), Says(_METRICS)] = quantity(
        "What is kept of a run."
    )
    optimise: Annotated[Optimise, Holds("a mapping with the fields " + ", ".join(Optimise.model_fields))] | None = (
        quantity(
            "What `conveyor-sim optimise` is after: points are chosen by what came of others, not by a design.",
            default=None,
        )
    )
    bags: Annotated[Literal["failed", "all", "none"], Says('"failed", "all" or "none"')] = quantity(
        "Of which runs a recording is kept.", default="failed"
    )

    def problems(self) -> Iterator[Problem]:
        """Yield all problems of a study whose fields are valid one by one."""
        if (self.scene is None) == (self.function is None):
            yield Problem((), "expected either scene or function")
        for name, parameter in self.parameters.items():
            path = ("parameters", name)
            yield from parameter.problems(path)
            if name in self.metrics or _is_reserved(name):
                yield Problem(path, f"{name} given as a name, expected another: runs have a column of that name")
            if parameter.argument is not None and self.function is None:
                yield Problem((*path, "argument"), "given, expected function beside it, which takes the argument")
            if parameter.controller is not None and self.controller is None:
                yield Problem((*path, "controller"), "given, expected controller beside parameters, which takes it")
            if self.warm_start is not None and parameter.controller is None:
                yield Problem(
                    (*path,), "varies the line, expected a parameter of the controller, as runs share a warm_start"
                )
        for name in self.metrics:
            if _is_reserved(name):
                yield Problem(("metrics", name), "given as a name, expected another: runs have a column of that name")
        yield from self._design_problems() if self.optimise is None else self._optimise_problems(self.optimise)
        yield from self.seeds.problems(("seeds",))
        runs = self._point_count() * (self.seeds.batch if self.seeds.count is None else self.seeds.count)
        if runs > MOST_RUNS:
            yield Problem(("seeds",), f"{runs} runs given by all points and seeds, expected at most {MOST_RUNS}")
        if self.seeds.until is not None and self.seeds.until.metric not in self.metrics:
            text = f"{shown(self.seeds.until.metric)} given, expected one of {', '.join(self.metrics)}"
            yield Problem(("seeds", "until", "metric"), text)

    def _design_problems(self) -> Iterator[Problem]:
        """Yield the problems of the points of a design."""
        yield from self._given_twice()
        for name, parameter in self.parameters.items():
            path = ("parameters", name, "values")
            if self.design in ("grid", "list") and parameter.values is None:
                yield Problem(path, f"missing, expected a list of values, as the design is a {self.design}")
            if self.design not in ("grid", "list") and parameter.values is not None:
                yield Problem(path, f"given, expected low and high, as the design is {self.design}")
        lengths = {len(parameter.values or ()) for parameter in self.parameters.values()}
        if self.design == "list" and len(lengths) > 1:
            numbers = ", ".join(map(str, sorted(lengths)))
            yield Problem(("design",), f"list given with {numbers} values, expected equally many of all parameters")
        if (self.points is None) != (self.design in ("grid", "list")):
            if self.points is None:
                yield Problem(("design",), f"{self.design} given, expected points beside it, how many")
            else:
                yield Problem(("points",), f"{self.points} given, expected none: a {self.design} has them by values")

    def _point_count(self) -> int:
        """Return the number of points, without building them."""
        if self.optimise is not None:
            return self.optimise.trials
        lengths = [len(parameter.values or ()) for parameter in self.parameters.values()]
        if self.design in ("grid", "list"):
            return math.prod(lengths) if self.design == "grid" else min(lengths)
        return (self.points or 1) * (len(lengths) + 2 if self.design == "saltelli" else 1)

    def _given_twice(self) -> Iterator[Problem]:
        """Points that would be run twice, and take part in comparisons as if they were two."""
        values = {name: parameter.values or () for name, parameter in self.parameters.items()}
        if self.design == "list":
            points = list(zip(*values.values(), strict=False))
            for place in _repeated(points):
                what = ", ".join(f"{name} {shown(value)}" for name, value in zip(values, points[place], strict=True))
                yield Problem(("design",), f"list given with the point {what} twice, expected each once")
        else:
            for name, own in values.items():
                for place in _repeated(own):
                    path = ("parameters", name, "values", place)
                    yield Problem(path, f"{shown(own[place])} given twice, expected each value once")

    def _optimise_problems(self, wanted: Optimise) -> Iterator[Problem]:
        """Yield the problems of an optimisation."""
        yield from self._given_twice()
        for name in ("design", "points"):
            if name in self.model_fields_set:
                yield Problem((name,), "given, expected none beside optimise, which chooses points")
        if self.seeds.count is None:
            yield Problem(("seeds",), "expected a count, as optimise compares points by as many seeds each")
        yield from wanted.problems(self.parameters, list(self.metrics))

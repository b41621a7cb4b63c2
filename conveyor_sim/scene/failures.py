# SPDX-License-Identifier: Apache-2.0
"""Failures and planned stops of machines in a scene file."""

from collections.abc import Iterator
from typing import Annotated, Literal

from annotated_types import Ge, Le, Len
from pydantic import AllowInfNan, Strict, Tag

from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Holds, NotNegative, Positive, Says, quantity
from conveyor_sim.scene.words import shown

Shape = Annotated[float, Strict(), AllowInfNan(False), Ge(0.1), Le(100), Says("a number from 0.1 to 100")]


class Exponential(Part):
    """Random times without memory, drawn from the seed."""

    kind: Literal["exponential"] = quantity("The kind of distribution.")
    mean: Positive = quantity("Mean time.", "s")


class Weibull(Part):
    """Random times drawn from the seed: early failures (shape below 1) or wear (above)."""

    kind: Literal["weibull"] = quantity("The kind of distribution.")
    mean: Positive = quantity("Mean time: the scale parameter times Gamma(1 + 1/shape).", "s")
    shape: Shape = quantity("Shape parameter; 1 is the exponential distribution.", "1")


class FixedTimes(Part):
    """Listed times."""

    kind: Literal["list"] = quantity("The kind of distribution.")
    times: Annotated[tuple[Positive, ...], Len(1), Holds("a list of numbers greater than 0, at least one")] = quantity(
        "Times in the order of use; after the last one, the first follows again.", "s"
    )


Times = Annotated[
    Annotated[Exponential, Tag("(exponential)")]
    | Annotated[Weibull, Tag("(weibull)")]
    | Annotated[FixedTimes, Tag("(list)")],
    one_of({"exponential": "(exponential)", "weibull": "(weibull)", "list": "(list)"}),
]
"""Distributions of times."""


_Times = Annotated[Times, Holds('a mapping with kind "exponential", "weibull" or "list"')]


class Failure(Part):
    """A recurring failure of a machine."""

    between: _Times = quantity("Time from the end of a repair, or from the start of the run, to the next failure.")
    repair: _Times = quantity("Time to repair.")
    counted: Literal["running", "clock"] = quantity(
        "Time that `between` counts. running: time in Execute, neither starved nor blocked; clock: all time.",
        default="running",
    )


class PlannedStop(Part):
    """A planned stop: a break, a changeover, cleaning. The machine stops, and starts again automatically."""

    start: NotNegative = quantity("Start of the first one.", "s")
    duration: Positive = quantity("Duration.", "s")
    every: Positive | None = quantity(
        "Time from the start of one to the start of the next. Left out: there is only one.", "s", default=None
    )

    def problems(self, path: Path) -> Iterator[Problem]:
        """Yield a problem for a planned stop that begins before the previous one has ended."""
        if self.every is not None and self.every <= self.duration:
            text = f"{shown(self.every)} given, expected more than the duration, {self.duration:g} (s)"
            yield Problem((*path, "every"), text)

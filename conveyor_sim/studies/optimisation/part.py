# SPDX-License-Identifier: Apache-2.0
"""The key `optimise` of a study file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from conveyor_sim.errors import StudyError
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.types import Count, Holds, Seed, Text, quantity
from conveyor_sim.scene.words import listed, shown
from conveyor_sim.studies.optimisation.objective import parse_objective
from conveyor_sim.studies.parameter import Parameter


class Optimise(Part):
    """Points are chosen one batch after the other, by what came of those before."""

    objective: Text = quantity("Such as `maximise efficiency subject to peak_force < 40`, of metrics by their names.")
    trials: Count = quantity("Points that are tried.", "1", default=64)
    batch: Count = quantity("Points that are chosen together: their runs can be made at the same time.", "1", default=8)
    start: Annotated[dict[str, Any], Holds("a mapping of every parameter to a value")] | None = quantity(
        "A point to try first, such as the settings that the line has; the best one is compared with it.", default=None
    )
    fresh_seeds: Count = quantity(
        "Seeds that no trial had, with which the best point and `start` are run in the end.", "1", default=20
    )
    sampler_seed: Seed = quantity("Of what chooses points.", "1", default=0)

    def first(self, parameters: Mapping[str, Parameter]) -> dict[str, Any]:
        """Return the first point to try: `start`, or an admissible point without it."""
        if self.start is not None:
            return dict(self.start)
        return {
            name: parameter.low if parameter.values is None else parameter.values[0]
            for name, parameter in parameters.items()
        }

    def problems(self, parameters: Mapping[str, Parameter], metrics: Sequence[str]) -> Iterator[Problem]:
        """Yield the problems of this part in a study with these parameters and metrics."""
        try:
            parse_objective(self.objective, metrics)
        except StudyError as error:
            yield Problem(("optimise", "objective"), str(error))
        if self.start is None:
            return
        if set(self.start) != set(parameters):
            names = listed([shown(name) for name in self.start]) if self.start else "nothing"
            yield Problem(("optimise", "start"), f"{names} given, expected a value for each of {', '.join(parameters)}")
            return
        for name, value in self.start.items():
            expected = _expected(parameters[name], value)
            if expected:
                yield Problem(("optimise", "start", name), f"{shown(value)} given, expected {expected}")


def _expected(parameter: Parameter, value: Any) -> str:
    """Return the expectation for an inadmissible value; "" for an admissible one."""
    if parameter.values is not None:
        return "" if value in parameter.values else listed([shown(one) for one in parameter.values])
    if parameter.low is None or parameter.high is None:
        return ""  # which is wrong by itself
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if number and parameter.low <= value <= parameter.high and (not parameter.whole or float(value).is_integer()):
        return ""
    return f"a {'whole ' if parameter.whole else ''}number from {parameter.low:g} to {parameter.high:g}"

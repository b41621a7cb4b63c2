# SPDX-License-Identifier: Apache-2.0
"""A parameter of a study: what varies, and over which values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated

from annotated_types import Len
from pydantic import AllowInfNan, StrictBool, StrictFloat, StrictInt, StrictStr

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.types import Flag, Holds, Number, Says, Text, quantity
from conveyor_sim.scene.words import listed, shown

_Value = Annotated[
    StrictBool | StrictInt | Annotated[StrictFloat, AllowInfNan(False)] | StrictStr,
    Says("a number that is finite, a text, true or false"),
]
_Path = re.compile(r"[A-Za-z]\w*(\[\d+\])*(\.[A-Za-z]\w*(\[\d+\])*)*")


class Parameter(Part):
    """Something that varies from point to point."""

    field: Text | None = quantity("Path of a field of the scene, such as `belts.main.speed`.", default=None)
    controller: Text | None = quantity("Name of a parameter of the controller's factory.", default=None)
    argument: Text | None = quantity("Name of an argument of the function that returns the scene.", default=None)
    values: Annotated[tuple[_Value, ...], Len(1), Holds("a list of values, at least one")] | None = quantity(
        "Its values: all of a grid, one a point of a list.", default=None
    )
    low: Number | None = quantity("Least value of a range, for the other designs.", "that of the field", default=None)
    high: Number | None = quantity("Greatest value of a range.", "that of the field", default=None)
    unit: Text | None = quantity("Unit of its values. Left out: that of the field.", default=None)
    log: Flag = quantity("Whether the range is divided by ratio.", default=False)
    whole: Flag = quantity("Whether values of the range are whole numbers.", default=False)

    def problems(self, path: tuple[str, ...]) -> Iterator[Problem]:
        """Yield the problems of this part by itself."""
        targets = [name for name in ("field", "controller", "argument") if getattr(self, name) is not None]
        if len(targets) != 1:
            said = listed(targets) if targets else "nothing"
            yield Problem(path, f"{said} given, expected one of field, controller and argument")
        if self.field is not None and not _Path.fullmatch(self.field):
            text = f"{shown(self.field)} given, expected a path such as belts.main.speed or contacts[0].friction"
            yield Problem((*path, "field"), text)
        ends = [end for end in ("low", "high") if getattr(self, end) is not None]
        if (self.values is None) != (len(ends) == 2):
            yield Problem(path, "expected either values, or low and high")
        if self.low is None or self.high is None:
            return
        if not self.low < self.high:
            yield Problem((*path, "high"), f"{shown(self.high)} given, expected more than low, {shown(self.low)}")
        if self.log and self.low <= 0.0:
            yield Problem((*path, "low"), f"{shown(self.low)} given, expected a number greater than 0, as log is true")

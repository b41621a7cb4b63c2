# SPDX-License-Identifier: Apache-2.0
"""Inspections of a scene file: machines that look at bottles."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from conveyor_sim.scene.parts.device_part import DevicePart, Mark, Others
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Point, quantity
from conveyor_sim.scene.words import shown


class Inspection(DevicePart):
    """A machine that detects bad bottles as their axes pass a line."""

    KIND: ClassVar[str] = "inspection"

    kind: Literal["inspection"] = quantity("The kind of machine.")
    from_: Point = quantity("One end of the line.", "m", alias="from")
    to: Point = quantity("The other end: bottles pass from the left to the right, seen from `from`.", "m")

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a line without length."""
        if self.from_ == self.to:
            yield Problem((*path, "to"), f"{shown(self.to)} given, expected another point than from")

    def mark(self, name: str) -> Mark:
        """Return its line."""
        return self._mark("check", name, (self.from_, self.to))

# SPDX-License-Identifier: Apache-2.0
"""Counters of a scene file."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import DevicePart, Mark, Others, line_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Point, quantity


class Counter(DevicePart):
    """A line that counts the bottles whose axis passes over it, by direction."""

    KIND: ClassVar[str] = "counter"

    from_: Point = quantity("One end. Seen from here to `to`, forward is from left to right.", "m", alias="from")
    to: Point = quantity("The other end.", "m")

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a line without length."""
        yield from line_problems(path, self.from_, self.to)

    def mark(self, name: str) -> Mark:
        """Return its line."""
        return self._mark("passage", name, (self.from_, self.to))

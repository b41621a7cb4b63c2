"""Sinks of a scene file: machines downstream."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from conveyor_sim.scene.parts.device_part import Exit, Others
from conveyor_sim.scene.parts.machine import rate_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import PolygonList, Positive, quantity


class Sink(Exit):
    """A machine downstream, such as a packer: takes one bottle after another out of a region, at most at a rate.

    Those that wait press on whatever stands at the end of the region: a rail.
    """

    KIND: ClassVar[str] = "sink"

    kind: Literal["sink"] = quantity("The kind of machine.")
    region: PolygonList = quantity("Where it takes bottles, in the order of their arrival: a simple polygon.", "m")
    rate: Positive = quantity("Bottles a second, at the start.", "1/s")
    rate_limit: Positive | None = quantity(
        "Greatest rate that a command may ask for. Left out: `rate`.", "1/s", default=None
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """A region that is none, and a rate beyond its limit."""
        yield from super().problems(path, others)
        yield from rate_problems(path, self.rate, self.rate_limit)

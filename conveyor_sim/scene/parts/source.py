"""Sources of a scene file: machines upstream."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from conveyor_sim.scene.parts.device_part import Entry, Others
from conveyor_sim.scene.parts.machine import rate_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, Name, NotNegative, Point, Positive, Share, quantity


class Source(Entry):
    """A machine upstream, such as a filler: gives bottles at a rate while it runs; without room it is blocked."""

    KIND: ClassVar[str] = "source"

    kind: Literal["source"] = quantity("The kind of machine.")
    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Where a bottle's axis appears.", "m")
    direction: Angle = quantity("Direction of its velocity.", "rad")
    speed: NotNegative = quantity("Its speed at first, along `direction`.", "m/s")
    rate: Positive = quantity("Bottles a second at the start.", "1/s")
    rate_limit: Positive | None = quantity(
        "Greatest rate that a command may ask for. Left out: `rate`.", "1/s", default=None
    )
    bad_share: Share = quantity("Share of bad bottles, drawn at random from the seed.", "1", default=0.0)
    bad_every: Count | None = quantity("Every so many-th bottle is bad.", "1", default=None)

    @property
    def heading(self) -> tuple[float, float]:
        """Direction (rad) and speed (m/s) with which bottles appear."""
        return self.direction, self.speed

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """A rate beyond its limit, and bad bottles given in two ways."""
        yield from rate_problems(path, self.rate, self.rate_limit)
        if self.bad_share and self.bad_every is not None:
            yield Problem(path, "both of bad_share and bad_every given, expected at most one of them")

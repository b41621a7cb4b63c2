# SPDX-License-Identifier: Apache-2.0
"""Infeeds of a scene file."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.bad import BadBottles
from conveyor_sim.scene.parts.device_part import Entry, Others
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.parts.switched import SwitchedTypes
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, Name, NotNegative, Point, Positive, quantity
from conveyor_sim.scene.words import shown


class Infeed(SwitchedTypes, Scattered, BadBottles, Entry):
    """A place where bottles enter, one behind the other."""

    KIND: ClassVar[str] = "infeed"

    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Position of the axis of a new bottle.", "m")
    direction: Angle = quantity("Direction of its velocity.", "rad")
    speed: NotNegative = quantity(
        "Initial speed along `direction`. Left out along a conveyor: the speed of the belt.", "m/s"
    )
    count: Count | None = quantity("Number of bottles that enter. Left out: there is no limit.", "1", default=None)
    gap: NotNegative | None = quantity(
        "Clear distance between bottles that come from a packed queue; alternatively `rate`.", "m", default=None
    )
    rate: Positive | None = quantity("Bottles per second; alternatively `gap`.", "1/s", default=None)
    rate_limit: Positive | None = quantity(
        "Largest rate that the command `rate` may set in a run. Left out: there is no such command.",
        "1/s",
        default=None,
    )
    start: NotNegative = quantity("Time at which the first bottle enters.", "s", default=0.0)
    timing_jitter: NotNegative = quantity(
        "Largest time by which a bottle is early or late (with `gap`: late only), drawn uniformly from the seed.",
        "s",
        default=0.0,
    )

    @property
    def most(self) -> int | None:
        """Number of bottles that enter; None without limit."""
        return self.count

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of feeding rules that exclude each other, and of jitter that would change the order."""
        if (self.gap is None) == (self.rate is None):
            given = "neither" if self.gap is None else "both"
            yield Problem(path, f"{given} of gap and rate given, expected one of them")
        yield from self.bad_problems(path)
        yield from self.type_problems(path)
        if self.rate_limit is not None and (self.rate is None or self.rate_limit < self.rate):
            expected = "none without rate" if self.rate is None else f"at least {self.rate:g} (1/s), the rate"
            yield Problem((*path, "rate_limit"), f"{shown(self.rate_limit)} given, expected {expected}")
        most = self.rate if self.rate_limit is None else self.rate_limit
        if self.rate is not None and most is not None and self.timing_jitter > 0.5 / most:
            yield Problem(
                (*path, "timing_jitter"),
                f"{shown(self.timing_jitter)} given, expected at most half the time between two bottles, "
                f"{0.5 / most:g} (s), so that they stay in order",
            )

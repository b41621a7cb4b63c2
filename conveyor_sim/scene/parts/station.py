# SPDX-License-Identifier: Apache-2.0
"""Stations of a scene file: machines that take bottles, work on them, and return them."""

from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal

from conveyor_sim.scene.parts.device_part import Mark, Others
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.parts.work import Working
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, NotNegative, Point, Positive, quantity
from conveyor_sim.scene.words import shown

ROUNDING = 1e-9
"""Tolerance of capacity / hold against rounding."""


class Station(Working, TakingPart, Scattered):
    """A machine such as a capper, a labeller, a rinser or a pasteuriser. It takes bottles out of a region in the order
    of their arrival, works on them, and returns them elsewhere on the line in this order, with their accumulated loads.

    A station holds one bottle for a cycle of 1 / rate, or up to `capacity` bottles, each for `hold`. Waiting bottles
    press on the rail at the end of the region.
    """

    KIND: ClassVar[str] = "station"

    kind: Literal["station"] = quantity("The kind of machine.")
    position: Point = quantity("Where it gives a bottle's axis back. Without room there, it is blocked.", "m")
    direction: Angle = quantity("Direction of the bottle's velocity then.", "rad")
    speed: NotNegative = quantity(
        "Its speed then, along `direction`. Left out along a conveyor: that of the belt.", "m/s"
    )
    capacity: Count = quantity(
        "Most bottles that it holds. With more than one it works like a conveyor that carries bottles through the "
        "machine: it takes one each 1 / rate, and stops while a bottle that is done has no room.",
        "1",
        default=1,
    )
    hold: Positive | None = quantity(
        "Time for which it holds each bottle while it runs at `rate`; at another rate it changes in inverse "
        "proportion. Left out: capacity / rate.",
        "s",
        default=None,
    )

    @property
    def carries(self) -> bool:
        """True if it carries several bottles, or holds one for a time other than a cycle."""
        return self.capacity > 1 or self.hold is not None

    @property
    def holding_time(self) -> float:
        """Time between intake and return of a bottle at `rate`, s."""
        return self.capacity / self.rate if self.hold is None else self.hold

    def marks(self, name: str) -> Sequence[Mark]:
        """Return the marks of the places where it takes and returns bottles."""
        return self._mark("exit", name, self.region), self._mark("entry", name, (self.position,), self.direction)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield further problems, those of its settings and tests, and tests of attributes that no station sets."""
        yield from super().problems(path, others)
        yield from self._hold_problems(path)
        yield from self.work_problems(path, others)

    def _hold_problems(self, path: Path) -> Iterator[Problem]:
        """Yield a problem of a rate at which it would hold more bottles than its capacity."""
        if self.hold is not None and self.rate * self.hold > self.capacity * (1.0 + ROUNDING):
            many = "a bottle that is" if self.capacity == 1 else f"{self.capacity} bottles that are each"
            text = f"{shown(self.rate)} given, expected at most {self.capacity / self.hold:g} (1/s), capacity / hold"
            yield Problem((*path, "rate"), f"{text}: it has room for {many} held for {self.hold:g} s")

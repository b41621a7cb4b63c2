# SPDX-License-Identifier: Apache-2.0
"""Stations of a scene file: machines that take bottles, work on them, and return them."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

from annotated_types import Len

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import Mark, Others, name_problems
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, Holds, Name, NotNegative, Number, Point, Positive, Share, quantity
from conveyor_sim.scene.words import shown, some_of

BAD = "bad"
"""Attribute that inspections, rejects and sinks use: 0 or 1."""

MOST_ATTRIBUTES = 20

MOST_CHANGES = 100
"""Largest number of bottle types that a station changes."""

ROUNDING = 1e-9
"""Tolerance of capacity / hold against rounding."""


class AttributeRule(Part):
    """Change of one attribute of a bottle by a station."""

    to: Number = quantity("New value, in the unit of the attribute. Attributes that were never set are 0.", "1")
    deviation: NotNegative = quantity(
        "Standard deviation of the value, normally distributed, drawn from the seed.", "1", default=0.0
    )
    share: Share = quantity("Share of the bottles that are changed, drawn from the seed.", "1", default=1.0)
    every: Count | None = quantity("Only every n-th bottle is changed.", "1", default=None)
    at: Annotated[tuple[Count, ...], Len(0), Holds("a list of whole numbers, 1 or greater")] = quantity(
        "Numbers of the bottles that are changed, counted from 1 in the order of arrival.", "1", default=()
    )

    def problems(self, path: Path, attribute: str) -> Iterator[Problem]:
        """Yield problems of choices of bottles that exclude each other, and of values of `bad` other than 0 and 1."""
        ways = {"share": self.share < 1.0, "every": self.every is not None, "at": bool(self.at)}
        given = [name for name, is_given in ways.items() if is_given]
        if len(given) > 1:
            yield Problem(path, f"{' and '.join(given)} given, expected at most one of them")
        if attribute == BAD and (self.to not in (0.0, 1.0) or self.deviation):
            yield Problem(path, f"{BAD} set to {self.to:g} +- {self.deviation:g}, expected 0 or 1, and no deviation")


class Acceptance(Part):
    """Limits of one attribute of a bottle. A bottle beyond them becomes bad."""

    low: Number | None = quantity("Least value. Left out: there is none.", "1", default=None)
    high: Number | None = quantity("Greatest value. Left out: there is none.", "1", default=None)
    false_accept: Share = quantity(
        "Share of the bottles beyond the limits that pass, drawn from the seed.", "1", default=0.0
    )
    false_reject: Share = quantity(
        "Share of the bottles within the limits that fail, drawn from the seed.", "1", default=0.0
    )

    def problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of limits that exclude or include all values."""
        if self.low is None and self.high is None:
            yield Problem(path, "neither low nor high given, expected one of them at least")
        elif self.low is not None and self.high is not None and self.low > self.high:
            yield Problem((*path, "low"), f"{shown(self.low)} given, expected at most {self.high:g}, as high is")


class Station(TakingPart, Scattered):
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
    changes: Annotated[
        dict[Name, Name], Len(0, MOST_CHANGES), Holds(f"a mapping of at most {MOST_CHANGES} types to types")
    ] = quantity(
        "Types that bottles have afterwards, by their types before: `empty: full`. Other types stay.", default={}
    )
    sets: Annotated[
        dict[Name, AttributeRule],
        Len(0, MOST_ATTRIBUTES),
        Holds(f"a mapping of at most {MOST_ATTRIBUTES} names of attributes to settings"),
    ] = quantity("What it does to attributes of a bottle, by their names: cap, label, fill_level, crooked.", default={})
    tests: Annotated[
        dict[Name, Acceptance],
        Len(0, MOST_ATTRIBUTES),
        Holds(f"a mapping of at most {MOST_ATTRIBUTES} names of attributes to tests"),
    ] = quantity("What it looks at, after that; bottles that it finds defective become bad.", default={})

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
        for before, after in self.changes.items():
            for name in (before, after):
                yield from name_problems((*path, "changes", before), name, "bottle_types", others)
            if before == after:
                yield Problem((*path, "changes", before), f"{shown(after)} given, expected another type")
        for name, setting in self.sets.items():
            yield from setting.problems((*path, "sets", name), name)
        stations = [machine for machine in others["machines"].values() if isinstance(machine, Station)]
        known = sorted({BAD, *(name for station in stations for name in station.sets)})
        for name, test in self.tests.items():
            yield from test.problems((*path, "tests", name))
            if name not in known:
                text = f"no station sets {shown(name)}, expected {some_of(known)}"
                yield Problem((*path, "tests", name), text)

    def _hold_problems(self, path: Path) -> Iterator[Problem]:
        """Yield a problem of a rate at which it would hold more bottles than its capacity."""
        if self.hold is not None and self.rate * self.hold > self.capacity * (1.0 + ROUNDING):
            many = "a bottle that is" if self.capacity == 1 else f"{self.capacity} bottles that are each"
            text = f"{shown(self.rate)} given, expected at most {self.capacity / self.hold:g} (1/s), capacity / hold"
            yield Problem((*path, "rate"), f"{text}: it has room for {many} held for {self.hold:g} s")

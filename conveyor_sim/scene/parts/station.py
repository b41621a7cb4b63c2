# SPDX-License-Identifier: Apache-2.0
"""Stations of a scene file: machines that take a bottle, work on it, and return it."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

from annotated_types import Len

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import Mark, Others
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, Holds, Name, NotNegative, Number, Point, Share, quantity
from conveyor_sim.scene.words import shown, some_of

BAD = "bad"
"""Attribute that inspections, rejects and sinks use: 0 or 1."""

MOST_ATTRIBUTES = 20


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
    """A machine such as a capper, a labeller or a checkweigher. It takes a bottle out of a region, holds it for a cycle
    of 1 / rate, works on it, and returns it elsewhere on the line, with its accumulated loads.

    Waiting bottles press on the rail at the end of the region.
    """

    KIND: ClassVar[str] = "station"

    kind: Literal["station"] = quantity("The kind of machine.")
    position: Point = quantity("Where it gives a bottle's axis back. Without room there, it is blocked.", "m")
    direction: Angle = quantity("Direction of the bottle's velocity then.", "rad")
    speed: NotNegative = quantity(
        "Its speed then, along `direction`. Left out along a conveyor: that of the belt.", "m/s"
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

    def marks(self, name: str) -> Sequence[Mark]:
        """Return the marks of the places where it takes and returns bottles."""
        return self._mark("exit", name, self.region), self._mark("entry", name, (self.position,), self.direction)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield further problems, those of its settings and tests, and tests of attributes that no station sets."""
        yield from super().problems(path, others)
        for name, setting in self.sets.items():
            yield from setting.problems((*path, "sets", name), name)
        stations = [machine for machine in others["machines"].values() if isinstance(machine, Station)]
        known = sorted({BAD, *(name for station in stations for name in station.sets)})
        for name, test in self.tests.items():
            yield from test.problems((*path, "tests", name))
            if name not in known:
                text = f"no station sets {shown(name)}, expected {some_of(known)}"
                yield Problem((*path, "tests", name), text)

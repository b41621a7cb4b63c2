# SPDX-License-Identifier: Apache-2.0
"""Work of stations and carousels on bottles: types, attributes and tests."""

from collections.abc import Iterator
from typing import Annotated

from annotated_types import Len

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import DevicePart, Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Count, Holds, Name, NotNegative, Number, Share, quantity
from conveyor_sim.scene.words import shown, some_of

BAD = "bad"
"""Attribute that inspections, rejects and sinks use: 0 or 1."""

MOST_ATTRIBUTES = 20

MOST_CHANGES = 100
"""Largest number of bottle types that a station changes."""


class AttributeRule(Part):
    """Change of one attribute of a bottle by a station or a carousel."""

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


class Working(DevicePart):
    """A part that works on bottles."""

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

    def work_problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of types, settings and tests, also of tests of attributes that nothing sets."""
        for before, after in self.changes.items():
            for name in (before, after):
                yield from name_problems((*path, "changes", before), name, "bottle_types", others)
            if before == after:
                yield Problem((*path, "changes", before), f"{shown(after)} given, expected another type")
        for name, setting in self.sets.items():
            yield from setting.problems((*path, "sets", name), name)
        workers = [part for parts in others.values() for part in parts.values() if isinstance(part, Working)]
        known = sorted({BAD, *(name for worker in workers for name in worker.sets)})
        for name, test in self.tests.items():
            yield from test.problems((*path, "tests", name))
            if name not in known:
                text = f"no station sets {shown(name)}, expected {some_of(known)}"
                yield Problem((*path, "tests", name), text)

# SPDX-License-Identifier: Apache-2.0
"""Base classes of scene parts that become devices of the line."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.polygons import why_not_simple
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import TOUCH, XY
from conveyor_sim.scene.words import shown, some_of

Others = Mapping[str, Mapping[str, Any]]
"""Other parts of a scene: by field (`zones`), then by name."""

Look = Literal["beam", "region", "passage", "check", "entry", "exit"]
"""Look of a part in pictures and markers. beam: a dashed line between two ends; passage: a line with an arrow to its
right; check: a line between two diamonds; region: an outline; exit: a hatched outline; entry: a triangle at a point.
"""


@dataclass(frozen=True)
class Mark:
    """Mark of a part in pictures."""

    look: Look
    kind: str
    """Kind, such as `photo_eye`."""
    name: str
    points: NDArray[np.float64]
    """(k, 2), m: two ends, the corners of a region, or one point."""
    direction: float = 0.0
    """Direction of bottles at an entry, rad."""
    word: str = ""
    """Word in pictures, such as "eye"."""


class DevicePart(Part):
    """A part that becomes a device."""

    KIND: ClassVar[str] = ""
    """Kind, such as `photo_eye`."""
    WORD: ClassVar[str] = ""
    """Word in pictures; empty: KIND."""

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of valid fields that do not fit together. path: of the part; others: to look up names."""
        yield from ()

    def mark(self, name: str) -> Mark | None:
        """Return its mark; None without one. name: of the part."""
        return None

    def marks(self, name: str) -> Sequence[Mark]:
        """Return all its marks."""
        mark = self.mark(name)
        return () if mark is None else (mark,)

    def _mark(self, look: Look, name: str, points: tuple[XY, ...], direction: float = 0.0) -> Mark:
        corners = np.array(points, dtype=np.float64).reshape(-1, 2)
        return Mark(look, self.KIND, name, corners, direction, self.WORD or self.KIND.replace("_", " "))


class Giver(DevicePart):
    """A part that puts bottles onto the line; it has the field `position`, where they appear."""

    if TYPE_CHECKING:
        position: XY

    @property
    def heading(self) -> tuple[float, float]:
        """Direction (rad) and speed (m/s) of new bottles."""
        return 0.0, 0.0

    def births(self) -> tuple[XY, ...]:
        """Places (m) of new bottles, including those farthest apart."""
        return (self.position,)


class Entry(Giver):
    """A part that new bottles come from; it has the field `bottle`, their type."""

    if TYPE_CHECKING:
        bottle: str

    @property
    def kinds(self) -> tuple[str, ...]:
        """Types of its bottles."""
        return (self.bottle,)

    @property
    def most(self) -> int | None:
        """Largest number of bottles; None without limit."""
        return None

    def mark(self, name: str) -> Mark | None:
        """Return a triangle at the place of new bottles."""
        return self._mark("entry", name, (self.position,), self.heading[0])


class Exit(DevicePart):
    """A part by which bottles leave; it has the field `region`, where their axes are then."""

    if TYPE_CHECKING:
        region: tuple[XY, ...]

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for an invalid region."""
        yield from polygon_problems((*path, "region"), self.region)

    def mark(self, name: str) -> Mark | None:
        """Return its region."""
        return self._mark("exit", name, self.region)


def polygon_problems(path: Path, corners: tuple[XY, ...]) -> Iterator[Problem]:
    """Yield a problem for a region that is no simple polygon."""
    if (reason := why_not_simple(corners)) is not None:
        yield Problem(path, f"{shown(corners)} given, expected a simple polygon ({reason})")


def line_problems(path: Path, start: XY, end: XY) -> Iterator[Problem]:
    """Yield a problem for a line from `from` to `to` without length. path: of the part."""
    if math.dist(start, end) <= TOUCH:
        yield Problem((*path, "to"), f"{shown(end)} given, expected a point away from `from` (zero length)")


def name_problems(path: Path, name: str | None, field: str, others: Others) -> Iterator[Problem]:
    """Yield a problem for a name that no part of a field has."""
    known = others[field]
    if name is not None and name not in known:
        listed = some_of(known) or "none: there are none"
        yield Problem(path, f"{shown(name)} given, expected a name from {field}: {listed}")

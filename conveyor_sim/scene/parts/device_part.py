"""`DevicePart`: what a part of a scene says of itself that becomes a device of the line."""

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
"""What else there is in a scene: parts by the name of their field (`zones`), then by their own."""

Look = Literal["beam", "region", "passage", "check", "entry", "exit"]
"""How pictures and markers draw a part. beam: a dashed line between two ends; passage: a line with an arrow to its
right; check: a line between two diamonds; region: an outline; exit: a hatched outline; entry: a triangle at a point.
"""


@dataclass(frozen=True)
class Mark:
    """What is drawn of a part."""

    look: Look
    kind: str
    """What it is, as in `photo_eye`."""
    name: str
    points: NDArray[np.float64]
    """(k, 2), m: two ends, the corners of a region, or one point."""
    direction: float = 0.0
    """rad, in which bottles go from an entry."""
    word: str = ""
    """What it is, for a picture: "eye"."""


class DevicePart(Part):
    """A part that becomes a device."""

    KIND: ClassVar[str] = ""
    """What it is, as in `photo_eye`."""
    WORD: ClassVar[str] = ""
    """The same for a picture, where that is another word."""

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """What is wrong with it although each field is valid by itself. path: its own; others: to look up names."""
        yield from ()

    def mark(self, name: str) -> Mark | None:
        """What is drawn of it; None: nothing. name: its own."""
        return None

    def marks(self, name: str) -> Sequence[Mark]:
        """The same, where it may be more than one."""
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
        """Direction (rad) and speed (m/s) with which they appear."""
        return 0.0, 0.0

    def births(self) -> tuple[XY, ...]:
        """Places (m) at which a bottle can appear, those farthest apart among them."""
        return (self.position,)


class Entry(Giver):
    """A part that new bottles come from; it has the field `bottle`, their type."""

    if TYPE_CHECKING:
        bottle: str

    @property
    def most(self) -> int | None:
        """Bottles that can come from it; None: without end."""
        return None

    def mark(self, name: str) -> Mark | None:
        """A triangle where bottles appear."""
        return self._mark("entry", name, (self.position,), self.heading[0])


class Exit(DevicePart):
    """A part by which bottles leave; it has the field `region`, where their axes are then."""

    if TYPE_CHECKING:
        region: tuple[XY, ...]

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """A region that is none."""
        yield from polygon_problems((*path, "region"), self.region)

    def mark(self, name: str) -> Mark | None:
        """Its region."""
        return self._mark("exit", name, self.region)


def polygon_problems(path: Path, corners: tuple[XY, ...]) -> Iterator[Problem]:
    """A region that is no simple polygon."""
    if (reason := why_not_simple(corners)) is not None:
        yield Problem(path, f"{shown(corners)} given, expected a simple polygon ({reason})")


def line_problems(path: Path, start: XY, end: XY) -> Iterator[Problem]:
    """A line from `from` to `to`, at whose part the path leads, that has no length."""
    if math.dist(start, end) <= TOUCH:
        yield Problem((*path, "to"), f"{shown(end)} given, expected a point away from `from` (zero length)")


def name_problems(path: Path, name: str | None, field: str, others: Others) -> Iterator[Problem]:
    """A name that is given and that no part of a field has."""
    known = others[field]
    if name is not None and name not in known:
        listed = some_of(known) or "none: there are none"
        yield Problem(path, f"{shown(name)} given, expected a name from {field}: {listed}")

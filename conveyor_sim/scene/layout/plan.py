# SPDX-License-Identifier: Apache-2.0
"""Plan of a layout: conveyors with their paths, for placing devices, checks and drawings."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.layout.routes import Bend, Route
from conveyor_sim.scene.types import XY

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


Box = tuple[float, float, float, float]
"""Lowest x and y, greatest x and y (m)."""


def box_of(points: Sequence[XY], margin: float = 0.0) -> Box:
    """Return the box of points (m), larger by a margin (m) on all sides."""
    x, y = zip(*points, strict=True)
    return min(x) - margin, min(y) - margin, max(x) + margin, max(y) + margin


@dataclass(frozen=True)
class Lane:
    """A lane of a conveyor: its right edge as a signed offset from the path (m), and its speed over the conveyor's."""

    right: float
    width: float
    ratio: float

    @property
    def left(self) -> float:
        """Signed offset (m) of the left edge."""
        return self.right + self.width


class GuideOnConveyor(Protocol):
    """One side of a guide, as seen from a conveyor."""

    @property
    def side(self) -> Side:
        """Side of the path that it guides."""

    def offset_on(self, conveyor: "ConveyorPlan", s: float) -> float | None:
        """Return the offset (m) at a station (m) of the conveyor; None without a guide. Openings count as closed."""


@dataclass(frozen=True)
class GuideProfile:
    """One side of a guide, by corners (station, offset) along a path (m). The last offset holds up to `end`."""

    side: Side
    corners: tuple[XY, ...]
    begin: float
    """Station where it begins (m)."""
    end: float
    """Station where it ends (m)."""
    shift: float = 0.0
    """Station of the guide's path at which a conveyor begins (m)."""

    def offset(self, s: float) -> float:
        """Return the offset (m) at a station (m) of the guide's path."""
        after = bisect_right(self.corners, s, key=lambda corner: corner[0])
        if after == 0 or after == len(self.corners):
            return self.corners[after - 1 if after else 0][1]
        (s0, offset0), (s1, offset1) = self.corners[after - 1 : after + 1]
        return offset0 + (offset1 - offset0) * ((s - s0) / (s1 - s0))

    def offset_on(self, conveyor: "ConveyorPlan", s: float) -> float | None:
        """Return the offset (m) at a station (m) of a conveyor; None where the guide doesn't follow it."""
        s += self.shift
        return self.offset(s) if self.begin <= s <= self.end else None


@dataclass
class ConveyorPlan:
    """A conveyor as laid out."""

    name: str
    route: Route
    lanes: tuple[Lane, ...]
    """From right to left."""
    material: str
    belts: tuple[str, ...] = ()
    """Names of its belts: one, or one per section, in the direction of travel."""
    starts: tuple[float, ...] = (0.0,)
    """Stations (m) at which its belts begin."""
    surfaces: tuple[str, ...] = ()
    """Names of its surfaces."""
    guides: list[GuideOnConveyor] = field(default_factory=list)

    @property
    def edges(self) -> XY:
        """Signed offsets (m) of the right and the left edge."""
        return self.lanes[0].right, self.lanes[-1].left

    @property
    def width(self) -> float:
        """Width (m)."""
        return self.edges[1] - self.edges[0]

    @property
    def box(self) -> Box:
        """Box that holds it, with half a width beyond either edge."""
        points = [self.route.start.xy, *(piece.end.xy for piece in self.route.pieces)]
        for piece in self.route.pieces:
            if isinstance(piece, Bend):
                x, y = piece.centre
                points += [(x - piece.radius, y - piece.radius), (x + piece.radius, y + piece.radius)]
        return box_of(points, self.width)

    def belt_at(self, s: float) -> str:
        """Return the name of the belt at a station (m)."""
        return self.belts[max(bisect_right(self.starts, s) - 1, 0)]

    def clear(self, s: float) -> XY:
        """Return the signed offsets (m) of the right and the left end of the clear width at a station (m).

        It is bounded by guides where there are any, else by the edges of the conveyor.
        """
        right, left = self.edges
        offsets = [(guide.side, guide.offset_on(self, s)) for guide in self.guides]
        rights = [offset for side, offset in offsets if side == "right" and offset is not None]
        lefts = [offset for side, offset in offsets if side == "left" and offset is not None]
        return max(rights, default=right), min(lefts, default=left)


@dataclass
class LayoutPlan:
    """All conveyors of a layout by name, in the order of the file."""

    conveyors: dict[str, ConveyorPlan] = field(default_factory=dict)

    def near(self, box: Box) -> list[ConveyorPlan]:
        """Return the conveyors that may meet what is in a box."""
        plans = list(self.conveyors.values())
        low_x, low_y, high_x, high_y = self._boxes
        meets = (low_x <= box[2]) & (box[0] <= high_x) & (low_y <= box[3]) & (box[1] <= high_y)
        return [plans[index] for index in np.flatnonzero(meets)]

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        return np.array([plan.box for plan in self.conveyors.values()]).reshape(-1, 4).T

"""Plan of a layout: conveyors with their paths, for placing devices, checks and drawings."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from conveyor_sim.scene.layout.routes import Route
from conveyor_sim.scene.types import XY

Side = Literal["left", "right"]


@dataclass(frozen=True)
class Lane:
    """A lane of a conveyor: its edges as signed offsets from the path (m), and its speed over the conveyor's."""

    right: float
    left: float
    ratio: float

    @property
    def width(self) -> float:
        """Width (m)."""
        return self.left - self.right


@dataclass(frozen=True)
class GuideProfile:
    """One side of a guide, as corners (station, offset from the path) of a conveyor (m), in order of stations."""

    side: Side
    corners: tuple[XY, ...]

    def offset(self, s: float) -> float | None:
        """Return the offset (m) at a station (m); None where there is no guide. Openings count as closed."""
        for (s0, offset0), (s1, offset1) in pairwise(self.corners):
            if s0 <= s <= s1:
                return offset0 + (offset1 - offset0) * ((s - s0) / (s1 - s0)) if s1 > s0 else offset1
        return None


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
    guides: list[GuideProfile] = field(default_factory=list)

    @property
    def width(self) -> float:
        """Width (m)."""
        return self.edges[1] - self.edges[0]

    @property
    def edges(self) -> XY:
        """Signed offsets (m) of the right and the left edge."""
        return self.lanes[0].right, self.lanes[-1].left

    def belt_at(self, s: float) -> str:
        """Return the name of the belt at a station (m)."""
        return next(name for name, start in zip(self.belts[::-1], self.starts[::-1], strict=True) if s >= start)

    def clear(self, s: float) -> XY:
        """Return the signed offsets (m) of the right and the left end of the clear width at a station (m).

        It is bounded by guides where there are any, else by the edges of the conveyor.
        """
        right, left = self.edges
        offsets = [(guide.side, guide.offset(s)) for guide in self.guides]
        rights = [offset for side, offset in offsets if side == "right" and offset is not None]
        lefts = [offset for side, offset in offsets if side == "left" and offset is not None]
        return max(rights, default=right), min(lefts, default=left)


@dataclass
class LayoutPlan:
    """All conveyors of a layout by name, in the order of the file."""

    conveyors: dict[str, ConveyorPlan] = field(default_factory=dict)

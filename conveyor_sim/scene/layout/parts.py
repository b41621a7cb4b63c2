# SPDX-License-Identifier: Apache-2.0
"""Parts of a layout in a scene file: conveyors by path, and guides along them."""

from collections.abc import Mapping
from typing import Annotated, Any

from annotated_types import Len
from pydantic import AfterValidator, Discriminator, Tag

from conveyor_sim.scene.drives import Drive
from conveyor_sim.scene.layout.plan import Side
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import (
    Angle,
    Component,
    Holds,
    Limits,
    Name,
    NotNegative,
    Number,
    Point,
    PointList,
    Positive,
    Says,
    Span,
    quantity,
)
from conveyor_sim.scene.vibration import ChainVibration
from conveyor_sim.scene.words import fields_of

MOST_PIECES = 1000
"""Largest number of entries of one list of a conveyor or guide."""


def _bounded(value: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a list. Raise ValueError if it is empty or too long; `Len` would do so for wrong entries as well."""
    if not 1 <= len(value) <= MOST_PIECES:
        raise ValueError("out of bounds")
    return value


def _by_type(data: Any) -> str | None:
    if isinstance(data, str):
        return "(name)"
    return "(more)" if isinstance(data, (Mapping, Part, list, tuple)) else None


DriveOrName = Annotated[
    Annotated[Drive, Tag("(more)")] | Annotated[Name, Tag("(name)")],
    Discriminator(_by_type),
    Holds(f"{fields_of(Drive)}, or a name from drives"),
]
MorePoints = Annotated[PointList, AfterValidator(_bounded)]
Names = Annotated[tuple[Name, ...], AfterValidator(_bounded), Holds(f"a list of 1 to {MOST_PIECES} names of conveyors")]
NameOrNames = Annotated[
    Annotated[Names, Tag("(more)")] | Annotated[Name, Tag("(name)")],
    Discriminator(_by_type),
    Holds("a name of a conveyor or a list of names"),
]


class Move(Part):
    """A piece of a path: `straight`, or `left` or `right` with `radius`."""

    straight: Positive | None = quantity("Length of a straight piece.", "m", default=None)
    left: Span | None = quantity("Angle of a bend to the left.", "rad", default=None)
    right: Span | None = quantity("Angle of a bend to the right.", "rad", default=None)
    radius: Positive | None = quantity("Radius of the middle of a bend.", "m", default=None)


class ConveyorLane(Part):
    """A lane of a conveyor: a surface with a width and a speed."""

    width: Positive = quantity("Width.", "m")
    ratio: Positive = quantity("Speed of the lane divided by the speed of the conveyor.", "1", default=1.0)


class _Driven(Part):
    speed: Number | None = quantity("Speed at the start, positive along travel. Left out: 0.", "m/s", default=None)
    speed_limits: Limits | None = quantity(
        "Smallest and largest speed that a command may set. Left out: as for `belts`.", "m/s", default=None
    )
    watchdog: Positive | None = quantity(
        "Without a speed command for this long, the conveyor stops. Left out: it keeps its speed.", "s", default=None
    )
    drive: DriveOrName | None = quantity(
        "Drive: a mapping for a separate drive, or the name of a drive in `drives`, which then has the speed.",
        default=None,
    )
    ratio: Positive | None = quantity(
        "Speed divided by the speed of the drive that it names. Left out: 1.", "1", default=None
    )
    axis: Name | None = quantity("Axis that moves it, instead of `drive`; needs `travel`.", default=None)
    travel: Positive | None = quantity("Travel per cycle of the `axis`.", "m", default=None)
    vibration: ChainVibration | None = quantity("Vibration of the chain. Left out: none.", default=None)


class ConveyorSection(_Driven):
    """A separately driven part of a conveyor, a belt `<conveyor>_<name>`. Fields left out are the conveyor's."""

    name: Name = quantity("Name of the section.")
    to: Positive | None = quantity(
        "Station where it ends, from the start of the conveyor. Left out for the last section only.", "m", default=None
    )
    material: Name | None = quantity("Material, as named in `base`.", default=None)


Range = Annotated[tuple[Component, Component], Says("two stations [from, to]")]
Ranges = Annotated[tuple[Range, ...], Len(0, MOST_PIECES), Holds("a list of ranges [from, to] of two numbers")]
Corner = Annotated[tuple[Component, Component], Says("a station and an offset [station, offset]")]
Corners = Annotated[
    tuple[Corner, ...],
    AfterValidator(_bounded),
    Holds("a list of corners [station, offset] of two numbers"),
]


class Openings(Part):
    """Stations without a guide, for gates, pushers and side transfers."""

    left: Ranges = quantity("On the left.", "m", default=())
    right: Ranges = quantity("On the right.", "m", default=())


class GuideSides(Part):
    """Sides of guides along a path."""

    material: Name = quantity("Material, as named in `contacts`.")
    clearance: Positive | None = quantity("Distance between both sides, half of it on either side.", "m", default=None)
    left: Corners | None = quantity(
        "Corners of the left side: stations along the path, and offsets from its middle, positive to the left. It "
        "begins at the first station, and keeps the last offset.",
        "m",
        default=None,
    )
    right: Corners | None = quantity("Corners of the right side, in the same way.", "m", default=None)
    from_: NotNegative | None = quantity(
        "Station where the guides begin. Left out: the start of the path, or the first corner.",
        "m",
        default=None,
        alias="from",
    )
    to: Positive | None = quantity("Station where they end. Left out: the end of the path.", "m", default=None)
    open: Openings = quantity("Stations without a guide.", default=Openings.model_construct())

    def corners(self, side: Side) -> tuple[tuple[float, float], ...] | None:
        """Return the corners of a side that is given by corners; None without them."""
        return self.left if side == "left" else self.right


class ConveyorGuides(GuideSides):
    """Guides along a conveyor: rails `<conveyor>_left` and `<conveyor>_right`, as those of `guides`.

    Given by `clearance`, they also cover the gap in front of a conveyor that is `after` another.
    """


class Guide(GuideSides):
    """Guides along conveyors, or on both sides of a line through points: rails `<guide>_left` and `<guide>_right`.

    Given by `clearance`, or by corners of `left`, of `right` or of both. A side with openings or bends has several
    rails, `<guide>_left_1` and so on. Where they meet, they are one surface.
    """

    along: NameOrNames | None = quantity(
        "Conveyor that it follows, or several that follow each other: stations count along all of them.", default=None
    )
    points: MorePoints | None = quantity(
        "Corners of the line halfway between both sides, instead of `along`; needs `clearance`.", "m", default=None
    )

    @property
    def conveyors(self) -> tuple[str, ...]:
        """Names of the conveyors that it follows."""
        return (self.along,) if isinstance(self.along, str) else self.along or ()


Moves = Annotated[tuple[Move, ...], AfterValidator(_bounded), Holds(f"a list of 1 to {MOST_PIECES} pieces")]
Lanes = Annotated[tuple[ConveyorLane, ...], AfterValidator(_bounded), Holds(f"a list of 1 to {MOST_PIECES} lanes")]
Sections = Annotated[
    tuple[ConveyorSection, ...], AfterValidator(_bounded), Holds(f"a list of 1 to {MOST_PIECES} sections")
]


class Conveyor(_Driven):
    """A conveyor along a path; positive speed is along travel.

    Placed by `start` and `heading`, by `after` or `beside` another, or by `points`.
    """

    material: Name = quantity("Material, as named in `base`.")
    start: Point | None = quantity("Middle of its start.", "m", default=None)
    heading: Angle | None = quantity(
        "Direction of travel at the start, counter-clockwise from the x-axis. Left out: 0.", "rad", default=None
    )
    after: Name | None = quantity("Conveyor at whose end it begins, with the same direction.", default=None)
    back: NotNegative | None = quantity(
        "Overlap with the end of the conveyor in `after`. The one that is listed later carries there.",
        "m",
        default=None,
    )
    beside: Name | None = quantity("Conveyor beside which it begins, with the same direction.", default=None)
    side: Side | None = quantity("Side of the conveyor in `beside` on which it is.", default=None)
    from_: NotNegative | None = quantity(
        "Station of the conveyor in `beside` at which it begins. Left out: 0.", "m", default=None, alias="from"
    )
    gap: NotNegative | None = quantity(
        "Distance from the end of the conveyor in `after`, or from the edge of the one in `beside`. Left out: 0.",
        "m",
        default=None,
    )
    offset: Number | None = quantity(
        "Sideways shift of the middle from that of the conveyor in `after`, positive to the left. Left out: 0.",
        "m",
        default=None,
    )
    plate: Name | None = quantity("Material of a plate at rest that fills the gap. Left out: no plate.", default=None)
    path: Moves | None = quantity("Pieces in the direction of travel.", default=None)
    points: MorePoints | None = quantity("Corners of its path, instead of `path`.", "m", default=None)
    radius: Positive | None = quantity(
        "Radius of the middle of the bends at the corners in `points`.", "m", default=None
    )
    width: Positive | None = quantity("Width; needed without `lanes`.", "m", default=None)
    lanes: Lanes | None = quantity("Lanes from right to left, each a surface, instead of `width`.", default=None)
    sections: Sections | None = quantity(
        "Parts in the direction of travel that are driven separately. Left out: one belt.", default=None
    )
    guides: ConveyorGuides | None = quantity("Guides along its path. Left out: none.", default=None)


class SceneLayout(Part):
    """Conveyors and guides of a scene, by name."""

    conveyors: Annotated[dict[Name, Conveyor], Holds("a mapping of names to conveyors")] = quantity(
        "Conveyors, which become belts. Where they overlap, the last one in the list carries.", default={}
    )
    guides: Annotated[dict[Name, Guide], Holds("a mapping of names to guides")] = quantity(
        "Guides along conveyors, which become rails.", default={}
    )

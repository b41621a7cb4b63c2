"""Belts of a scene file: straight ones, and sectors of a ring with their rails."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Tag

from conveyor_sim.scene.drives import Drive
from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.parts.device_part import DevicePart, Others
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import (
    Angle,
    Flag,
    Limits,
    Name,
    NotNegative,
    Number,
    Point,
    Positive,
    Span,
    quantity,
)
from conveyor_sim.scene.words import shown


class _Belt(DevicePart):
    KIND: ClassVar[str] = "belt"

    speed: Number = quantity("Speed at the start, positive forward.", "m/s", default=0.0)
    speed_limits: Limits = quantity("Least and greatest speed that a command may ask for.", "m/s", default=(-3.0, 3.0))
    material: Name = quantity("Material, as named in `base`.")
    watchdog: Positive | None = quantity(
        "Without a speed command for this long, the belt stops. Left out: it keeps its speed.", "s", default=None
    )
    drive: Drive | None = quantity(
        "What moves it. Left out: it has the commanded speed from one tick to the next.", default=None
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a speed beyond its limits, or limits in the wrong order."""
        least, greatest = self.speed_limits
        if least > greatest:
            text = f"{shown(self.speed_limits)} given, expected the smaller number first (m/s)"
            yield Problem((*path, "speed_limits"), text)
        elif not least <= self.speed <= greatest:
            yield Problem(
                (*path, "speed"),
                f"{shown(self.speed)} given, expected a number from {least:g} to {greatest:g} (m/s), the speed_limits",
            )


class StraightBelt(_Belt):
    """A rectangle that runs along its length."""

    kind: Literal["straight"] = quantity("The kind of belt.")
    start: Point = quantity(
        "Corner where the belt begins, on the right-hand side seen along travel; the width grows to the left.", "m"
    )
    angle: Angle = quantity("Direction of travel at positive speed, from the x-axis, counter-clockwise.", "rad")
    length: Positive = quantity("Length along travel.", "m")
    width: Positive = quantity("Width across travel.", "m")


class BeltRails(Part):
    """Rails along the arcs of a curved belt."""

    inner: Flag = quantity("A rail along the inner arc, named `<belt>_inner`.", default=False)
    outer: Flag = quantity("A rail along the outer arc, named `<belt>_outer`.", default=False)
    material: Name | None = quantity("Material of these rails; needed if there is one.", default=None)


class CurvedBelt(_Belt):
    """A sector of a ring that turns about its centre; speed holds at the centre line, positive counter-clockwise.

    Given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`.
    """

    kind: Literal["curved"] = quantity("The kind of belt.")
    inner_radius: NotNegative = quantity("Radius R of the inner arc.", "m")
    width: Positive = quantity("Width, from the inner to the outer arc.", "m")
    centre: Point | None = quantity("Centre of the arcs.", "m", default=None)
    start_angle: Angle | None = quantity("Where the sector begins, seen from the centre.", "rad", default=None)
    span: Span | None = quantity("Angle of the sector, counter-clockwise.", "rad", default=None)
    from_: Point | None = quantity("One end of the inner arc.", "m", default=None, alias="from")
    to: Point | None = quantity("The other end of the inner arc.", "m", default=None)
    side: Literal["left", "right"] | None = quantity(
        "Side of the line from `from` to `to` on which the centre lies; the shorter arc is meant. "
        "Positive speed runs from `from` to `to` if left, from `to` to `from` if right.",
        default=None,
    )
    rails: BeltRails = quantity("Rails along the arcs.", default=BeltRails.model_construct())


Belt = Annotated[
    Annotated[StraightBelt, Tag("(straight)")] | Annotated[CurvedBelt, Tag("(curved)")],
    one_of({"straight": "(straight)", "curved": "(curved)"}),
]

"""Belts of a scene file: straight ones, and sectors of a ring with their rails."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, SerializerFunctionWrapHandler, Tag, model_serializer

from conveyor_sim.scene.drives import Drive, SpeedSetpoint
from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.parts.device_part import Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import (
    Angle,
    Flag,
    Holds,
    Name,
    NotNegative,
    Point,
    Positive,
    Span,
    quantity,
)
from conveyor_sim.scene.words import fields_of, shown


def _drive_tag(data: Any) -> str | None:
    if isinstance(data, str):
        return "(name)"
    return "(mapping)" if isinstance(data, (Mapping, Drive)) else None


_Drive = Annotated[
    Annotated[Drive, Tag("(mapping)")] | Annotated[Name, Tag("(name)")],
    Discriminator(_drive_tag),
    Holds(f"{fields_of(Drive)}, or a name from drives"),
]

_OF_DRIVE = ("speed", "speed_limits", "watchdog")
"""Fields that belong to the drive if a belt names one."""


class _Belt(SpeedSetpoint):
    KIND: ClassVar[str] = "belt"

    material: Name = quantity("Material, as named in `base`.")
    drive: _Drive | None = quantity(
        "What moves it: a drive of its own, or the name of one from `drives`, which then has the speed, the "
        "speed_limits and the watchdog. Left out: it has the commanded speed from one tick to the next.",
        default=None,
    )
    ratio: Positive = quantity("Speed of the belt over that of the drive that it names.", "1", default=1.0)

    @property
    def drive_name(self) -> str | None:
        """Name of the drive from `drives` that moves it; None without one."""
        return self.drive if isinstance(self.drive, str) else None

    @model_serializer(mode="wrap")
    def _without_foreign_fields(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the fields that this belt can't have, so that a scene can be read again from its fields."""
        foreign = ("ratio",) if self.drive_name is None else _OF_DRIVE
        return {name: value for name, value in handler(self).items() if name not in foreign}

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of speeds and limits, of an unknown drive, and of fields that belong to a drive."""
        yield from super().problems(path, others)
        yield from name_problems((*path, "drive"), self.drive_name, "drives", others)
        if self.drive_name is None:
            if "ratio" in self.model_fields_set:
                text = f"{shown(self.ratio)} given, expected it only with the name of a drive from `drives`"
                yield Problem((*path, "ratio"), text)
            return
        for field in _OF_DRIVE:
            if field in self.model_fields_set:
                value = getattr(self, field)
                yield Problem(
                    (*path, field), f"{shown(value)} given, expected none here: drives.{self.drive_name} has it"
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

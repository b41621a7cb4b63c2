# SPDX-License-Identifier: Apache-2.0
"""Belts of a scene file: straight ones, sectors of a ring with their rails, and paths of several surfaces."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, SerializerFunctionWrapHandler, Tag, model_serializer

from conveyor_sim.scene.areas import TURN_TEXT, CurvedArea, StraightArea, Turn
from conveyor_sim.scene.drives import Drive, SpeedSetpoint
from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.parts.device_part import Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Flag, Holds, Name, Positive, quantity
from conveyor_sim.scene.vibration import ChainVibration
from conveyor_sim.scene.words import fields_of, shown

_RATIO_TEXT = "Speed of the surface divided by the speed of the belt."


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
"""Fields that belong to the drive or axis if a belt names one."""


class _Belt(SpeedSetpoint):
    KIND: ClassVar[str] = "belt"

    material: Name = quantity("Material, as named in `base`.")
    drive: _Drive | None = quantity(
        "Drive: a mapping for a separate drive, or the name of a drive in `drives`, which then has the speed, "
        "the speed_limits and the watchdog. Left out: the belt reaches the commanded speed within one tick.",
        default=None,
    )
    ratio: Positive = quantity(
        "Speed of the belt divided by the speed of the drive that it names. With `axis`, for a curved belt: angular "
        "speed divided by that of the axis.",
        "1",
        default=1.0,
    )
    axis: Name | None = quantity(
        "Axis that moves it, instead of `drive`. A curved belt turns with it, as the table of a carousel does; other "
        "belts need `travel`.",
        default=None,
    )
    travel: Positive | None = quantity("Travel per cycle of the `axis`, at the centre line.", "m", default=None)
    vibration: ChainVibration | None = quantity("Vibration of the chain. Left out: none.", default=None)

    @property
    def drive_name(self) -> str | None:
        """Name of the drive from `drives` that moves it; None without one."""
        return self.drive if isinstance(self.drive, str) else None

    @property
    def has_foreign_drive(self) -> bool:
        """True if a named drive or an axis moves it, so that it takes no commands."""
        return self.drive_name is not None or self.axis is not None

    @model_serializer(mode="wrap")
    def _without_foreign_fields(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the fields that this belt can't have, so that a scene can be read again from its fields."""
        foreign = set(_OF_DRIVE if self.has_foreign_drive else ("ratio",))
        foreign |= {name for name in ("axis", "travel") if getattr(self, name) is None}
        if self.axis is not None:
            foreign |= {"drive", *(("ratio",) if self.travel is not None else ())}
        return {name: value for name, value in handler(self).items() if name not in foreign}

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of speeds and limits, of an unknown drive, and of fields that belong to a drive."""
        yield from super().problems(path, others)
        yield from name_problems((*path, "drive"), self.drive_name, "drives", others)
        yield from name_problems((*path, "axis"), self.axis, "axes", others)
        yield from self._axis_problems(path)
        if not self.has_foreign_drive:
            if "ratio" in self.model_fields_set:
                text = f"{shown(self.ratio)} given, expected it only with the name of a drive from `drives`"
                yield Problem((*path, "ratio"), text)
            return
        owner = f"drives.{self.drive_name}" if self.axis is None else f"axes.{self.axis}"
        for field in _OF_DRIVE:
            if field in self.model_fields_set:
                value = getattr(self, field)
                yield Problem((*path, field), f"{shown(value)} given, expected none here: {owner} has it")

    def _axis_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of fields that go with an axis."""
        turns = isinstance(self, CurvedBelt)
        if self.axis is None:
            if self.travel is not None:
                yield Problem((*path, "travel"), f"{shown(self.travel)} given, expected it only with axis")
        elif self.drive is not None:
            yield Problem((*path, "axis"), f"{shown(self.axis)} given with drive, expected one of them")
        elif self.travel is None and not turns:
            yield Problem((*path, "travel"), "none given with axis, expected the travel per cycle of the axis (m)")
        elif "ratio" in self.model_fields_set and self.travel is not None:
            yield Problem((*path, "ratio"), f"{shown(self.ratio)} given with travel, expected one of them")


class StraightBelt(StraightArea, _Belt):
    """A rectangle that runs along its length."""


class BeltRails(Part):
    """Rails along the arcs of a curved belt."""

    inner: Flag = quantity("A rail along the inner arc, named `<belt>_inner`.", default=False)
    outer: Flag = quantity("A rail along the outer arc, named `<belt>_outer`.", default=False)
    material: Name | None = quantity("Material of these rails; needed if there is one.", default=None)


class CurvedBelt(CurvedArea, _Belt):
    """A sector of a ring that turns about its centre; its speed holds at the centre line.

    Given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`.
    """

    turn: Turn = quantity(TURN_TEXT, default="left")
    rails: BeltRails = quantity("Rails along the arcs.", default=BeltRails.model_construct())

    @property
    def middle_radius(self) -> float:
        """Radius of the centre line, m, where the speed of the belt holds."""
        return self.inner_radius + self.width / 2


class StraightSurface(StraightArea):
    """A rectangular surface of a path belt."""

    ratio: Positive = quantity(_RATIO_TEXT, "1", default=1.0)


class CurvedSurface(CurvedArea):
    """A surface of a path belt that turns about a centre; its speed holds at the centre line.

    Given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`.
    """

    turn: Turn = quantity(TURN_TEXT, default="left")
    ratio: Positive = quantity(_RATIO_TEXT, "1", default=1.0)


BeltSurface = Annotated[
    Annotated[StraightSurface, Tag("(straight)")] | Annotated[CurvedSurface, Tag("(curved)")],
    one_of({"straight": "(straight)", "curved": "(curved)"}),
]


_SURFACES = "a list of surfaces, at least one"


class PathBelt(_Belt):
    """Several surfaces that move together: pieces one behind the other, or lanes side by side.

    It is one device with one speed. Figures name its surfaces `<belt>_1`, `<belt>_2` and so on.
    """

    kind: Literal["path"] = quantity("The kind of belt.")
    surfaces: Annotated[tuple[BeltSurface, ...], Holds(_SURFACES)] = quantity(
        "Surfaces in the direction of travel. Where they overlap, the last one in the list carries."
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of every belt, and one without surfaces."""
        yield from super().problems(path, others)
        if not self.surfaces:  # a minimum length of the field would also report lists whose entries are all invalid
            yield Problem((*path, "surfaces"), f"[] given, expected {_SURFACES}")


Belt = Annotated[
    Annotated[StraightBelt, Tag("(straight)")]
    | Annotated[CurvedBelt, Tag("(curved)")]
    | Annotated[PathBelt, Tag("(path)")],
    one_of({"straight": "(straight)", "curved": "(curved)", "path": "(path)"}),
]

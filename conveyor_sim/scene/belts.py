"""Belts of a scene file: straight ones, sectors of a ring with their rails, and paths of several surfaces."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from annotated_types import Len
from pydantic import Tag

from conveyor_sim.scene.areas import TURN_TEXT, CurvedArea, StraightArea, Turn
from conveyor_sim.scene.drives import Drive
from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.parts.device_part import DevicePart, Others
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Flag, Holds, Limits, Name, Number, Positive, quantity
from conveyor_sim.scene.words import shown

_RATIO_TEXT = "Speed of the surface over that of the belt."


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


class PathBelt(_Belt):
    """Several surfaces that move together: pieces one behind the other, or lanes side by side.

    It is one device with one speed. Figures name its surfaces `<belt>_1`, `<belt>_2` and so on.
    """

    kind: Literal["path"] = quantity("The kind of belt.")
    surfaces: Annotated[tuple[BeltSurface, ...], Len(1), Holds("a list of surfaces, at least one")] = quantity(
        "Its surfaces, along travel. Where they overlap, the last listed carries."
    )


Belt = Annotated[
    Annotated[StraightBelt, Tag("(straight)")]
    | Annotated[CurvedBelt, Tag("(curved)")]
    | Annotated[PathBelt, Tag("(path)")],
    one_of({"straight": "(straight)", "curved": "(curved)", "path": "(path)"}),
]

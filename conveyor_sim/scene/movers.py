"""Rails of a scene file that move on command: gates, pushers and diverters. All are straight."""

from typing import Annotated, Literal

from pydantic import Tag

from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.types import Angle, Flag, Name, Point, Positive, quantity


class _Mover(Part):
    material: Name = quantity("Material, as named in `contacts`.")


class _Sliding(_Mover):
    direction: Angle = quantity("Direction in which it slides, from the x-axis, counter-clockwise.", "rad")
    stroke: Positive = quantity("How far it slides.", "m")
    max_speed: Positive = quantity("Its greatest speed.", "m/s")
    acceleration: Positive = quantity("Acceleration with which it starts, turns round and stops.", "m/s^2")


class _Swinging(_Mover):
    angle: Angle = quantity("Angle through which it swings about `from`, counter-clockwise if positive.", "rad")
    max_speed: Positive = quantity("Its greatest angular speed.", "rad/s")
    acceleration: Positive = quantity("Angular acceleration with which it starts, turns round and stops.", "rad/s^2")


class SlidingGate(_Sliding):
    """A gate or a stop that slides open."""

    kind: Literal["slide"] = quantity("The kind of gate.")
    from_: Point = quantity("One end while it is closed.", "m", alias="from")
    to: Point = quantity("The other end while it is closed.", "m")
    open: Flag = quantity("Whether it is open at the start.", default=False)


class SwingingGate(_Swinging):
    """A gate or a stop that swings open about its first end."""

    kind: Literal["swing"] = quantity("The kind of gate.")
    from_: Point = quantity("The end about which it swings.", "m", alias="from")
    to: Point = quantity("The other end while it is closed.", "m")
    open: Flag = quantity("Whether it is open at the start.", default=False)


class Pusher(_Sliding):
    """A straight rail that strokes along a direction, and returns."""

    from_: Point = quantity("One end while it is retracted.", "m", alias="from")
    to: Point = quantity("The other end while it is retracted.", "m")


class Diverter(_Swinging):
    """A straight rail that swings about its first end into the way of bottles, and returns."""

    from_: Point = quantity("The pivot.", "m", alias="from")
    to: Point = quantity("The other end while it does not divert.", "m")


Gate = Annotated[
    Annotated[SlidingGate, Tag("(slide)")] | Annotated[SwingingGate, Tag("(swing)")],
    one_of({"slide": "(slide)", "swing": "(swing)"}),
]
"""The kinds of gate."""

Mover = SlidingGate | SwingingGate | Pusher | Diverter

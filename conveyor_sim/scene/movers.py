"""Rails of a scene file that move on command: gates, pushers and diverters. All are straight.

Their drives are taken for pneumatic cylinders at 6 bar, of the bores of ISO 6432: 20 mm at gates that slide, 25 mm at
pushers, and 25 mm at a crank of 50 mm where rails swing. A bore of 20 mm is that of common stop cylinders for single
bottles; what rejects and diverts is one size larger.
"""

import math
from typing import Annotated, Literal

from pydantic import Tag

from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.types import Angle, Flag, Limit, Name, Point, Positive, quantity

PRESSURE = 6e5
"""Pa, above that of the air: what compressed air in a plant has."""


def cylinder_force(bore: float) -> float:
    """Force (N) of a cylinder of a bore (m) that pushes, without friction, to a tenth: pi/4 bore^2 times PRESSURE."""
    return round(0.25 * math.pi * bore**2 * PRESSURE, 1)


GATE_FORCE, PUSHER_FORCE = cylinder_force(0.020), cylinder_force(0.025)
"""188.5 N, 294.5 N."""

CRANK_TORQUE = round(0.05 * PUSHER_FORCE, 1)
"""14.7 N m."""


class _Mover(Part):
    material: Name = quantity("Material, as named in `contacts`.")


class _Sliding(_Mover):
    direction: Angle = quantity("Direction in which it slides, from the x-axis, counter-clockwise.", "rad")
    stroke: Positive = quantity("How far it slides.", "m")
    max_speed: Positive = quantity("Its greatest speed.", "m/s")
    acceleration: Positive = quantity("Acceleration with which it starts, turns round and stops.", "m/s^2")
    force_limit: Limit = quantity(
        "The most that its drive can push with; what takes more holds it up, or moves it back. Default: a cylinder of "
        "20 mm bore at 6 bar (ISO 6432).",
        "N",
        default=GATE_FORCE,
    )
    moving_mass: Positive = quantity(
        "Mass of all that slides: rail, carriage and piston rod. It counts only beyond the limit.", "kg", default=1.0
    )


class _Swinging(_Mover):
    angle: Angle = quantity("Angle through which it swings about `from`, counter-clockwise if positive.", "rad")
    max_speed: Positive = quantity("Its greatest angular speed.", "rad/s")
    acceleration: Positive = quantity("Angular acceleration with which it starts, turns round and stops.", "rad/s^2")
    torque_limit: Limit = quantity(
        "The most that its drive can turn with; what takes more holds it up, or moves it back. Default: a cylinder of "
        "25 mm bore at 6 bar (ISO 6432) at a crank of 50 mm.",
        "N m",
        default=CRANK_TORQUE,
    )
    inertia: Positive | None = quantity(
        "Moment of inertia about `from` of all that swings. It counts only beyond the limit. Left out: that of a rod "
        "of 1 kg, length^2 / 3.",
        "kg m^2",
        default=None,
    )


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
    force_limit: Limit = quantity(
        "The most that its drive can push with; what takes more holds it up, or moves it back. Default: a cylinder of "
        "25 mm bore at 6 bar (ISO 6432).",
        "N",
        default=PUSHER_FORCE,
    )


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

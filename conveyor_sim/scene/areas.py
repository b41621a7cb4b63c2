# SPDX-License-Identifier: Apache-2.0
"""Areas of surfaces in a scene file: rectangles, and sectors of a ring."""

from typing import Literal

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Angle, NotNegative, Point, Positive, Span, quantity


class StraightArea(Part):
    """A rectangle."""

    kind: Literal["straight"] = quantity("Its shape.")
    start: Point = quantity(
        "Corner at the start, on the right-hand side seen along `angle`; the belt extends to the left of it.", "m"
    )
    angle: Angle = quantity(
        "Direction of its length, from the x-axis, counter-clockwise. A belt travels in this direction at positive "
        "speed.",
        "rad",
    )
    length: Positive = quantity("Length along `angle`.", "m")
    width: Positive = quantity("Width across `angle`.", "m")


class CurvedArea(Part):
    """A sector of a ring, given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`."""

    kind: Literal["curved"] = quantity("Its shape.")
    inner_radius: NotNegative = quantity("Radius R of the inner arc.", "m")
    width: Positive = quantity("Width, from the inner to the outer arc.", "m")
    centre: Point | None = quantity("Centre of the arcs.", "m", default=None)
    start_angle: Angle | None = quantity("Where the sector begins, seen from the centre.", "rad", default=None)
    span: Span | None = quantity("Angle of the sector, counter-clockwise.", "rad", default=None)
    from_: Point | None = quantity("One end of the inner arc.", "m", default=None, alias="from")
    to: Point | None = quantity("The other end of the inner arc.", "m", default=None)
    side: Literal["left", "right"] | None = quantity(
        "Side of the line from `from` to `to` on which the centre lies. The arc is the shorter one.", default=None
    )


Turn = Literal["left", "right"]
"""Sense of travel at positive speed round a centre: counter-clockwise to the left, clockwise to the right."""

TURN_TEXT = (
    "Sense of travel at positive speed. left: counter-clockwise; right: clockwise, from the end of the sector to its "
    "start. With `side` equal to `turn` it runs from `from` to `to`, else from `to` to `from`. The area is the same."
)
"""Description of fields of type Turn."""

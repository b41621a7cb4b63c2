# SPDX-License-Identifier: Apache-2.0
"""Places of devices along a conveyor, as given in a scene file. Each replaces coordinates of a device."""

from typing import Annotated, Literal

from conveyor_sim.scene.layout.plan import Side
from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Angle, Name, Number, Positive, Says, quantity

PathStation = Annotated[Number | Literal["end"], Says('a number, negative from the end, or "end"')]


class Along(Part):
    """A place along a conveyor."""

    along: Name = quantity("Conveyor along which it is placed, instead of coordinates.")


class _At(Along):
    at: PathStation = quantity(
        'Station: distance from the start of the conveyor along its path. A negative number counts from the end, "end" '
        "is the end.",
        "m",
    )


class AlongPoint(_At):
    """A point along a conveyor."""

    offset: Number = quantity("Distance from the middle of the path, positive to the left.", "m", default=0.0)


class _Across(_At):
    offset: Number = quantity("Sideways shift, positive to the left.", "m", default=0.0)
    width: Positive | None = quantity(
        "Its width, half of it on either side of `offset`. Left out: the clear width between the guides, or the width "
        "of the conveyor on a side without guide.",
        "m",
        default=None,
    )
    extend: Number = quantity("Length by which it is longer at either end.", "m", default=0.0)


class AlongLine(_Across):
    """A line across a conveyor, from its right to its left, seen along travel: forward is along travel."""


class _Stretch(Along):
    at: PathStation | None = quantity(
        'Station where it ends, with `length`; a negative number counts from the end, "end" is the end.',
        "m",
        default=None,
    )
    length: Positive | None = quantity("Its length before `at`.", "m", default=None)
    from_: PathStation | None = quantity(
        "Station where it begins, instead of `at` and `length`. Left out beside `to`: the start.",
        "m",
        default=None,
        alias="from",
    )
    to: PathStation | None = quantity("Station where it ends. Left out beside `from`: the end.", "m", default=None)


class AlongRegion(_Stretch):
    """A region along a conveyor. In bends, a polygon approximates the arcs."""

    offset: Number = quantity("Sideways shift, positive to the left.", "m", default=0.0)
    width: Positive | None = quantity(
        "Its width, half of it on either side of `offset`. Left out: the width of the conveyor.", "m", default=None
    )


class AlongRail(Along):
    """A rail across a conveyor (`at`), or along it (`from`, `to`)."""

    at: PathStation | None = quantity(
        'Station of a rail across; a negative number counts from the end, "end" is the end.', "m", default=None
    )
    width: Positive | None = quantity(
        "Length of a rail across, half of it on either side of `offset`. Left out: the clear width.", "m", default=None
    )
    extend: Number = quantity("Length by which a rail across is longer at either end.", "m", default=0.0)
    from_: PathStation | None = quantity(
        "Station where a rail along the conveyor begins. Left out beside `to`: the start.",
        "m",
        default=None,
        alias="from",
    )
    to: PathStation | None = quantity("Station where it ends. Left out beside `from`: the end.", "m", default=None)
    offset: Number = quantity(
        "Distance of a rail along from the middle of the path, positive to the left; shift of a rail across.",
        "m",
        default=0.0,
    )


class AlongSlide(_Across):
    """A sliding gate across a conveyor. It opens to its side."""

    side: Side = quantity("Side to which it slides.")
    stroke: Positive | None = quantity("Stroke length. Left out: its length.", "m", default=None)


class AlongSwing(_Across):
    """A swinging gate across a conveyor. It turns about its end on its side."""

    side: Side = quantity("Side of the end about which it swings.")
    angle: Angle = quantity("Angle through which it swings, positive with travel.", "rad")


class AlongPusher(_Stretch):
    """A pusher beside a conveyor. It pushes across, away from its side."""

    side: Side = quantity("Side on which it is while it is retracted.")
    offset: Number | None = quantity(
        "Distance of its face from the middle of the path, positive to the left. Left out: the edge of the clear "
        "width.",
        "m",
        default=None,
    )


class AlongDiverter(Along):
    """A diverter beside a conveyor, along travel from its pivot while it does not divert."""

    at: PathStation = quantity(
        'Station of its pivot; a negative number counts from the end, "end" is the end.',
        "m",
    )
    side: Side = quantity("Side on which it is while it does not divert.")
    length: Positive = quantity("Length from the pivot to the other end, with travel.", "m")
    angle: Angle = quantity("Angle through which it swings, positive into the path.", "rad")
    offset: Number | None = quantity(
        "Distance of its pivot from the middle of the path, positive to the left. Left out: the edge of the clear "
        "width.",
        "m",
        default=None,
    )


class AlongDivider(Along):
    """A divider that swings, along travel from its pivot at an angle of 0. Positive angles are to the left."""

    at: PathStation = quantity(
        'Station of its pivot; a negative number counts from the end, "end" is the end.',
        "m",
    )
    length: Positive = quantity("Length from the pivot to the other end, with travel.", "m")
    offset: Number = quantity(
        "Distance of its pivot from the middle of the path, positive to the left.", "m", default=0.0
    )


class AlongSlidingDivider(_Stretch):
    """A divider that slides across a straight part of a conveyor.

    Its positions are distances from the middle of the path, positive to the left.
    """


class AlongAdjustable(_Stretch):
    """An adjustable guide beside a straight part of a conveyor.

    Its positions are distances from the middle of the path.
    """

    side: Side = quantity("Side on which it is.")


class AlongLift(_Across):
    """A lifting gate across a conveyor."""


class AlongClamp(_Stretch):
    """A clamp whose jaws stand along a straight part of a conveyor, and close across."""

    offset: Number = quantity(
        "Distance of its middle from the middle of the path, positive to the left.", "m", default=0.0
    )
    opening: Positive | None = quantity(
        "Distance of the jaws while they are open. Left out: the clear width between the guides.", "m", default=None
    )

# SPDX-License-Identifier: Apache-2.0
"""Places of star wheels, infeed screws and side belts along a conveyor."""

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from conveyor_sim.scene.layout.along import Along, PathStation
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.frames import turned
from conveyor_sim.scene.layout.plan import Side
from conveyor_sim.scene.layout.routes import Straight
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.quantities import is_finite, to_si
from conveyor_sim.scene.types import Number, quantity
from conveyor_sim.scene.words import shown


class AlongStar(Along):
    """A star wheel that takes bottles from a conveyor. Its pitch circle touches the line on which they come."""

    at: PathStation = quantity(
        'Station where it takes bottles; a negative number counts from the end, "end" is the end.', "m"
    )
    side: Side = quantity("Side of the conveyor on which the wheel is, and to which bottles turn.")
    offset: Number = quantity(
        "Distance of the line of bottles from the middle of the path, positive to the left.", "m", default=0.0
    )


class AlongScrew(Along):
    """An infeed screw beside a straight piece of a conveyor."""

    from_: PathStation = quantity("Station where it begins.", "m", alias="from")
    to: PathStation = quantity("Station where it hands bottles over.", "m")
    offset: Number = quantity(
        "Distance of the line of bottles from the middle of the path, positive to the left.", "m", default=0.0
    )


class AlongSideBelt(Along):
    """A side belt along a straight piece of a conveyor. Its surface runs with travel at positive speed."""

    from_: PathStation = quantity("Station where it begins.", "m", alias="from")
    to: PathStation = quantity("Station where it ends.", "m")
    offset: Number = quantity("Distance of its surface from the middle of the path, positive to the left.", "m")


def star(site: Site[AlongStar], device: Mapping[str, Any]) -> list[Coordinate]:
    """Return centre, turn and entry of a wheel. Raise LayoutFault.

    device: the wheel as written.
    """
    place, s = site.place, site.station()
    left = place.side == "left"
    radius = _radius(device)
    frame = site.conveyor.route.frame(s).moved(0.0, place.offset)
    centre = frame.point(0.0, radius if left else -radius)
    return [
        Coordinate("centre", site.within_limits(centre), "at"),
        Coordinate("turn", place.side, "side"),
        Coordinate("entry", turned(frame.angle, -0.5 * math.pi if left else 0.5 * math.pi), "at"),
    ]


def line_along(site: Site[AlongScrew] | Site[AlongSideBelt]) -> list[Coordinate]:
    """Return both ends of a line along a straight piece of a conveyor. Raise LayoutFault."""
    begin, end, field = site.stretch()
    pieces = [piece for _, piece in site.conveyor.route.parts(begin, end)]
    if len(pieces) > 1 or not isinstance(pieces[0], Straight):
        text = f"{shown(site.raw[field])} given, expected a stretch that lies on one straight piece of the conveyor"
        raise LayoutFault((*site.path, field), text)
    frames = (pieces[0].start, pieces[0].end)
    ends = [site.within_limits(frame.point(0.0, site.place.offset)) for frame in frames]
    return [Coordinate("from", ends[0], "from"), Coordinate("to", ends[1], "to")]


def _radius(device: Mapping[str, Any]) -> float:
    """Return the pitch radius (m) of a wheel as written; 1 if it is invalid, which is reported with its field."""
    value: Any = device.get("pitch_radius")
    if isinstance(value, str):
        with suppress(ValueError):
            return float(to_si(value, "m"))
        return 1.0
    return float(value) if is_finite(value) else 1.0

# SPDX-License-Identifier: Apache-2.0
"""Places along a conveyor where bottles come onto the line: point, direction, speed and scatter."""

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from conveyor_sim.scene.layout.along import AlongPoint
from conveyor_sim.scene.layout.plan import ConveyorPlan
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.quantities import is_finite, to_si

LATERAL_SCATTER = 5e-4
"""Default scatter to each side of bottles placed along a conveyor (m): less than guides usually leave."""
ANGULAR_SCATTER = math.radians(0.5)


def position(site: Site[AlongPoint]) -> list[Coordinate]:
    """Return the place of a device at a point. Raise LayoutFault."""
    return [Coordinate("position", site.point(site.station(), site.place.offset), "at")]


def entry(site: Site[AlongPoint], device: Mapping[str, Any]) -> list[Coordinate]:
    """Return place, direction, speed and scatter of bottles of a device. Raise LayoutFault.

    The scatter is at most what the guides leave free.
    """
    s, offset = site.station(), site.place.offset
    free = _free(site.conveyor, s, offset, _radius(site.scene, device))
    return [
        *position(site),
        Coordinate("direction", site.conveyor.route.heading(s), "at"),
        Coordinate("speed", _speed(site.conveyor, s, offset, site.scene), "along"),
        Coordinate("lateral_jitter", min(LATERAL_SCATTER, free), "along"),
        Coordinate("angular_jitter", ANGULAR_SCATTER if free else 0.0, "along"),
    ]


def grid(site: Site[AlongPoint]) -> list[Coordinate]:
    """Return first bottle and direction of a grid of bottles at a point. Raise LayoutFault."""
    s = site.station()
    heading = site.conveyor.route.heading(s)
    return [Coordinate("origin", site.point(s, site.place.offset), "at"), Coordinate("angle", heading, "at")]


def _free(conveyor: ConveyorPlan, s: float, offset: float, radius: float) -> float:
    """Return the distance (m) from a bottle at a station and an offset (m) to the nearest guide, at least 0.

    Guides are taken as near as they come within a radius along the path.
    """
    free = math.inf
    for station in (max(s - radius, 0.0), s, min(s + radius, conveyor.route.length)):
        for guide in conveyor.guides:
            if (place := guide.offset_on(conveyor, station)) is not None:
                free = min(free, (place - offset if guide.side == "left" else offset - place) - radius)
    return max(free, 0.0)


def _radius(scene: Mapping[str, Any], device: Mapping[str, Any]) -> float:
    """Return the radius (m) of the bottles of a device: the largest of all if it takes any."""
    kinds = _mapping(scene.get("bottle_types"))
    kind = device.get("bottle")
    some = [kinds[kind]] if isinstance(kind, str) and kind in kinds else kinds.values()
    return max((_number(_mapping(one).get("radius"), "m") for one in some), default=0.0)


def _speed(conveyor: ConveyorPlan, s: float, offset: float, scene: Mapping[str, Any]) -> float:
    """Return the initial speed (m/s) of a conveyor at a station and an offset (m), 0 if it runs backwards."""
    belt = _mapping(_mapping(scene.get("belts")).get(conveyor.belt_at(s)))
    drive, speed = belt.get("drive"), belt.get("speed", 0.0)
    ratio = 1.0
    if isinstance(drive, str):
        speed = _mapping(_mapping(scene.get("drives")).get(drive)).get("speed", 0.0)
        ratio = _number(belt.get("ratio", 1.0), "1")
    if isinstance(belt.get("axis"), str):
        speed = _axis_rate(belt["axis"], scene, 0) * _number(belt.get("travel", 0.0), "m")
    lane = next((lane.ratio for lane in conveyor.lanes if lane.right <= offset <= lane.left), 1.0)
    return max(_number(speed, "m/s") * ratio * lane, 0.0)


_LONGEST_TRAIN = 100
"""Largest number of masters of an axis that are followed. A circle is reported by the axes."""


def _axis_rate(name: str, scene: Mapping[str, Any], masters: int) -> float:
    """Return the initial rate of an axis, 1/s."""
    axis = _mapping(_mapping(scene.get("axes")).get(name))
    master, drive = axis.get("master"), axis.get("drive")
    if isinstance(master, str) and axis.get("in_gear", True) is True and masters < _LONGEST_TRAIN:
        return _number(axis.get("ratio", 1.0), "1") * _axis_rate(master, scene, masters + 1)
    if isinstance(drive, str):
        speed = _number(_mapping(_mapping(scene.get("drives")).get(drive)).get("speed", 0.0), "m/s")
        travel = _number(axis.get("travel", 0.0), "m")
        return speed / travel if travel else 0.0
    return _number(axis.get("rate", 0.0), "1/s")


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _number(value: Any, unit: str) -> float:
    """Return the value of another part's field; 0 if it is invalid, which is reported there."""
    if isinstance(value, str):
        with suppress(ValueError):
            return float(to_si(value, unit))
        return 0.0
    return float(value) if is_finite(value) else 0.0

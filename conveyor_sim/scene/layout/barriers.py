# SPDX-License-Identifier: Apache-2.0
"""Moving rails and rails along a conveyor: gates, pushers, diverters, dividers, guides, and rails at rest."""

import math
from collections.abc import Iterator
from typing import Any

from conveyor_sim.scene.layout.along import (
    AlongAdjustable,
    AlongClamp,
    AlongDiverter,
    AlongDivider,
    AlongLift,
    AlongLine,
    AlongPusher,
    AlongRail,
    AlongSlide,
    AlongSlidingDivider,
    AlongSwing,
)
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.frames import turned
from conveyor_sim.scene.layout.plan import GuideProfile, Side
from conveyor_sim.scene.layout.profile_rails import rails_along
from conveyor_sim.scene.layout.routes import Bend
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.words import shown

_QUARTER = 0.5 * math.pi


def line(site: Site[AlongLine] | Site[AlongLift]) -> list[Coordinate]:
    """Return a line across, from the right to the left. Raise LayoutFault."""
    s = site.station()
    right, left = site.across(s)
    return [Coordinate("from", site.point(s, right), "at"), Coordinate("to", site.point(s, left), "at")]


def sliding_gate(site: Site[AlongSlide]) -> list[Coordinate]:
    """Return a gate across that slides to its side. Raise LayoutFault."""
    s, place = site.station(), site.place
    right, left = site.across(s)
    stroke = left - right if place.stroke is None else place.stroke
    return [
        Coordinate("from", site.point(s, right), "at"),
        Coordinate("to", site.point(s, left), "at"),
        Coordinate("direction", _sideways(site, s, place.side), "side"),
        Coordinate("stroke", stroke, "side" if place.stroke is None else "stroke"),
    ]


def swinging_gate(site: Site[AlongSwing]) -> list[Coordinate]:
    """Return a gate across that swings about its end on its side. Raise LayoutFault."""
    s, place = site.station(), site.place
    right, left = site.across(s)
    pivot, end = (left, right) if place.side == "left" else (right, left)
    return [
        Coordinate("from", site.point(s, pivot), "at"),
        Coordinate("to", site.point(s, end), "at"),
        Coordinate("angle", place.angle if place.side == "left" else -place.angle, "angle"),
    ]


def pusher(site: Site[AlongPusher]) -> list[Coordinate]:
    """Return a pusher beside the path. Raise LayoutFault."""
    (begin, end, field), place = site.stretch(), site.place
    ends = [site.point(s, site.edge(s, place.side) if place.offset is None else place.offset) for s in (begin, end)]
    away: Side = "right" if place.side == "left" else "left"
    return [
        Coordinate("from", ends[0], field),
        Coordinate("to", ends[1], field),
        Coordinate("direction", _sideways(site, 0.5 * (begin + end), away), "side"),
    ]


def diverter(site: Site[AlongDiverter]) -> list[Coordinate]:
    """Return a diverter beside the path. Raise LayoutFault."""
    s, place = site.station(), site.place
    pivot = site.conveyor.route.frame(s).moved(0.0, site.edge(s, place.side) if place.offset is None else place.offset)
    return [
        Coordinate("from", site.within_limits(pivot.xy), "at"),
        Coordinate("to", site.within_limits(pivot.point(place.length, 0.0)), "length"),
        Coordinate("angle", -place.angle if place.side == "left" else place.angle, "angle"),
    ]


def swinging_divider(site: Site[AlongDivider]) -> list[Coordinate]:
    """Return a divider that swings about its pivot. Raise LayoutFault."""
    pivot = site.conveyor.route.frame(site.station()).moved(0.0, site.place.offset)
    return [
        Coordinate("from", site.within_limits(pivot.xy), "at"),
        Coordinate("to", site.within_limits(pivot.point(site.place.length, 0.0)), "length"),
    ]


def sliding_divider(site: Site[AlongSlidingDivider]) -> list[Coordinate]:
    """Return a divider in the middle of the path that slides across. Raise LayoutFault."""
    return _across_straight(site, "left")


def adjustable(site: Site[AlongAdjustable]) -> list[Coordinate]:
    """Return a guide in the middle of the path that slides to its side. Raise LayoutFault."""
    return _across_straight(site, site.place.side)


def clamp(site: Site[AlongClamp]) -> list[Coordinate]:
    """Return a clamp whose first jaw is on the right. Raise LayoutFault."""
    begin, _, field = site.stretch()
    right, left = site.clear(begin)
    opening = left - right if site.place.opening is None else site.place.opening
    return [
        *_across_straight(site, "left", site.place.offset - 0.5 * opening),
        Coordinate("opening", opening, field if site.place.opening is None else "opening"),
    ]


def _across_straight(site: Site[Any], side: Side, offset: float = 0.0) -> list[Coordinate]:
    """Return a rail at an offset (m) along a straight part of the path that slides to a side. Raise LayoutFault."""
    begin, end, field = site.stretch()
    route = site.conveyor.route
    if any(isinstance(piece, Bend) for piece in route.between(begin, end).pieces):
        text = f"a bend lies between {begin:.6g} m and {end:.6g} m, expected a straight part of conveyor"
        raise LayoutFault((*site.path, field), f"{text} {site.conveyor.name}")
    return [
        Coordinate("from", site.point(begin, offset), field),
        Coordinate("to", site.point(end, offset), field),
        Coordinate("direction", _sideways(site, begin, side), "side" if "side" in site.raw else field),
    ]


def rails(site: Site[AlongRail]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield the rails of an entry of `rails`, each with the field that it comes from. Raise LayoutFault.

    A rail along several bends and straight pieces is several rails that join.
    """
    place = site.place
    if place.at is not None:
        for name in ("from", "to"):
            if name in site.raw:
                text = f"{shown(site.raw[name])} given beside at, expected either at, or from and to"
                raise LayoutFault((*site.path, name), text)
        s = site.station()
        right, left = site.across(s)
        yield {"kind": "segment", "from": site.point(s, right), "to": site.point(s, left)}, "at"
        return
    for name in ("width", "extend"):
        if name in site.raw:
            raise LayoutFault((*site.path, name), f"{shown(site.raw[name])} given, expected at beside it")
    if "from" not in site.raw and "to" not in site.raw:
        raise LayoutFault(site.path, "no station given, expected either at, or from and to")
    begin, end, field = site.stretch()
    profile = GuideProfile("left", ((begin, place.offset),), begin, end)
    for rail in rails_along(site.conveyor.route, profile, [(begin, end)], (*site.path, "offset")):
        yield rail, field


def _sideways(site: Site[Any], s: float, side: Side) -> float:
    """Return the direction (rad) to a side of the path at a station (m)."""
    return turned(site.conveyor.route.heading(s), _QUARTER if side == "left" else -_QUARTER)

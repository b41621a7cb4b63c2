"""Regions along a conveyor as polygons. Arcs become chords."""

import math
from collections.abc import Iterator

from conveyor_sim.scene.layout.along import AlongRegion
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.routes import Bend, Route
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.types import TOUCH, XY

_CHORD = math.radians(7.5)
"""Largest angle of a chord. It is up to 0.2 % of the radius off the arc."""


def region(site: Site[AlongRegion]) -> list[Coordinate]:
    """Return the region of a device. Raise LayoutFault."""
    begin, end, field = site.stretch()
    place = site.place
    right, left = site.conveyor.edges if place.width is None else (-0.5 * place.width, 0.5 * place.width)
    part = site.conveyor.route.between(begin, end)
    for piece in part.pieces:
        if isinstance(piece, Bend) and not _reaches(piece, right + place.offset, left + place.offset):
            text = f"reaches beyond the centre of a bend of radius {piece.radius:.6g} m, expected a narrower region"
            raise LayoutFault(site.path if place.width is None else (*site.path, "width"), text)
    corners = polygon(part, right + place.offset, left + place.offset)
    return [Coordinate("region", [site.within_limits(corner) for corner in corners], field)]


def polygon(route: Route, right: float, left: float) -> list[XY]:
    """Return the corners, counter-clockwise, of the area between two offsets (m) from a route."""
    frames = [route.frame(s) for s in _stations(route)]
    corners = [frame.point(0.0, right) for frame in frames] + [frame.point(0.0, left) for frame in reversed(frames)]
    return list(_apart(corners))


def _reaches(bend: Bend, right: float, left: float) -> bool:
    """Return True if both offsets are on the same side of the centre of a bend, or in it."""
    inner = left if bend.turn > 0.0 else -right
    return inner <= bend.radius + TOUCH


def _stations(route: Route) -> Iterator[float]:
    """Yield the stations (m) of corners along a route."""
    yield 0.0
    for index, piece in enumerate(route.pieces):
        begin, end = route.stations[index : index + 2]
        if isinstance(piece, Bend):
            chords = math.ceil(abs(piece.turn) / _CHORD - 1e-9)
            yield from (begin + piece.length * (number / chords) for number in range(1, chords))
        yield end


def _apart(corners: list[XY]) -> Iterator[XY]:
    """Yield the corners of a polygon without those that are where the one before them is: the centre of a bend."""
    for before, corner in zip([corners[-1], *corners], corners, strict=False):
        if math.dist(before, corner) > TOUCH:
            yield corner

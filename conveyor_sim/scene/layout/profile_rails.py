# SPDX-License-Identifier: Apache-2.0
"""Rails of guides along a path: polylines on straight pieces, arcs in bends."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.plan import GuideProfile
from conveyor_sim.scene.layout.routes import Bend, Route
from conveyor_sim.scene.layout.surfaces import sector
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import TOUCH, XY

Stretch = tuple[float, float]
"""First and last station (m)."""


def rails_along(route: Route, profile: GuideProfile, parts: Sequence[Stretch], path: Path) -> Iterator[dict[str, Any]]:
    """Yield the geometry of rails along the parts of a route. path: of the guide. Raise LayoutFault.

    Each straight run is one polyline and each bend one arc; their ends are the same points.
    """
    runs = list(_runs(route))
    for first, last in parts:
        for begin, end, bend in runs[bisect_right(runs, first, key=lambda run: run[1]) :]:
            if begin >= last:
                break
            low, high = max(first, begin), min(last, end)
            if high - low <= TOUCH:
                continue
            if bend is None:
                yield {"kind": "polyline", "points": [list(route.point(*node)) for node in _nodes(profile, low, high)]}
            else:
                yield _arc(bend, _offset_in_bend(profile, low, high, path), low - begin, high - begin, path)


def _runs(route: Route) -> Iterator[tuple[float, float, Bend | None]]:
    """Yield first and last station (m) of each bend, and of each run of straight pieces (None)."""
    begin = 0.0
    for index, piece in enumerate(route.pieces):
        end = route.stations[index + 1]
        following = route.pieces[index + 1] if index + 1 < len(route.pieces) else None
        if isinstance(piece, Bend):
            yield begin, end, piece
        elif following is None or isinstance(following, Bend):
            yield begin, end, None
        else:
            continue
        begin = end


def _nodes(profile: GuideProfile, low: float, high: float) -> list[XY]:
    """Return the stations and offsets (m) of a profile at two stations and at the corners between them."""
    first = bisect_right(profile.corners, low + TOUCH, key=_station)
    inside = profile.corners[first : bisect_left(profile.corners, high - TOUCH, key=_station)]
    return [(low, profile.offset(low)), *inside, (high, profile.offset(high))]


def _station(corner: XY) -> float:
    return corner[0]


def _offset_in_bend(profile: GuideProfile, low: float, high: float, path: Path) -> float:
    nodes = _nodes(profile, low, high)
    offset = nodes[0][1]
    for (_, before), (_, after) in pairwise(nodes):
        if abs(after - before) > TOUCH:
            raise LayoutFault(
                path,
                f"the offset changes from {before:.6g} m to {after:.6g} m in the bend at stations {low:.6g} to "
                f"{high:.6g} m, expected one offset throughout a bend",
            )
    return offset


def _arc(bend: Bend, offset: float, low: float, high: float, path: Path) -> dict[str, Any]:
    """Return the arc at an offset between two distances (m) from the start of a bend."""
    radius = bend.radius - offset if bend.turn > 0.0 else bend.radius + offset
    if radius <= TOUCH:
        text = f"the offset is {offset:.6g} m in a bend of radius {bend.radius:.6g} m"
        raise LayoutFault(path, f"{text}, expected a guide that doesn't reach the centre")
    return {"kind": "arc", "centre": list(bend.centre), "radius": radius, **sector(bend.between(low, high))}

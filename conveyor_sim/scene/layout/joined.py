# SPDX-License-Identifier: Apache-2.0
"""Paths of conveyors that follow each other, joined to one path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.frames import turned
from conveyor_sim.scene.layout.plan import ConveyorPlan
from conveyor_sim.scene.layout.routes import PathPiece, Route, Straight
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import TOUCH

_TOLERANCE = 1e-6
"""Largest distance (m) and angle (rad) between paths that meet."""
_MOST_PIECES = 5_000


@dataclass(frozen=True)
class JoinedRoute:
    """One path along several conveyors."""

    route: Route
    places: tuple[tuple[ConveyorPlan, float, float], ...]
    """Each conveyor, with the stations of the path (m) at which it begins and beyond which it no longer counts."""


def joined(plans: Sequence[ConveyorPlan], path: Path) -> JoinedRoute:
    """Return the path along conveyors in order. path: of their list. Raise LayoutFault where they don't meet.

    A gap between two conveyors is part of the path. Where the next one begins before the end, the path changes to it.
    """
    pieces: list[PathPiece] = []
    places: list[tuple[ConveyorPlan, float, float]] = []
    before, begun = plans[0], 0.0
    for index, plan in enumerate(plans[1:], start=1):
        station = _meeting(before, plan, (*path, index))
        pieces += _up_to(before.route, station, plan)
        if len(pieces) > _MOST_PIECES:
            raise LayoutFault(path, f"{len(pieces)} pieces given, expected at most {_MOST_PIECES}")
        start = Route(tuple(pieces)).length
        overlap, first = before.route.length - station, plan.route.pieces[0]
        beyond = min(max(overlap, 0.0), first.length if isinstance(first, Straight) else 0.0)
        places.append((before, begun, start + beyond))
        before, begun = plan, start
    route = Route((*pieces, *before.route.pieces))
    return JoinedRoute(route, (*places, (before, begun, route.length)))


def _meeting(before: ConveyorPlan, plan: ConveyorPlan, path: Path) -> float:
    """Return the station of a conveyor (m) at which the next begins; beyond the end if there is a gap."""
    start, best = plan.route.start, math.inf
    route = before.route
    for station, piece in zip(route.stations[-2::-1], route.pieces[::-1], strict=True):
        along, left, turn = _seen(piece, start.xy, start.angle)
        inside = -_TOLERANCE <= along <= piece.length + _TOLERANCE or (piece is route.pieces[-1] and along > 0.0)
        if inside and abs(left) <= _TOLERANCE and abs(turn) <= _TOLERANCE:
            return station + along
        if inside and abs(turn) <= _TOLERANCE and abs(left) < abs(best):
            best = left
    if math.isfinite(best):
        where = f"{abs(best):.6g} m to the {'left' if best > 0.0 else 'right'} of its path"
    else:
        x, y = route.end.seen_from(start.xy)
        turn = math.degrees(turned(start.angle, -route.end.angle))
        where = f"{x:.6g} m along and {y:.6g} m to the left of its end, turned by {turn:.6g} deg"
    raise LayoutFault(path, f"{plan.name} follows {before.name} but begins {where}, expected conveyors that meet")


def _seen(piece: PathPiece, point: tuple[float, float], angle: float) -> tuple[float, float, float]:
    """Return station and offset of a point on a piece (m), and the direction (rad) relative to the piece there.

    Beyond the end of a bend, stations count along its tangent.
    """
    along, left = piece.end.seen_from(point)
    if isinstance(piece, Straight) or along >= 0.0:
        return piece.length + along, left, turned(angle, -piece.end.angle)
    x, y = point[0] - piece.centre[0], point[1] - piece.centre[1]
    side = math.copysign(1.0, piece.turn)
    heading = turned(math.atan2(y, x), side * 0.5 * math.pi)
    travelled = side * turned(heading, -piece.start.angle)
    if travelled < -_TOLERANCE:
        travelled += 2.0 * math.pi
    return travelled * piece.radius, side * (piece.radius - math.sqrt(x * x + y * y)), turned(angle, -heading)


def _up_to(route: Route, station: float, plan: ConveyorPlan) -> tuple[PathPiece, ...]:
    """Return the pieces up to a station (m), or up to the start of the next conveyor beyond the end."""
    start = plan.route.start
    if station > route.length + TOUCH:
        return (*route.pieces, Straight(route.end, start, station - route.length))
    if station <= TOUCH:
        return ()
    pieces = route.between(0.0, min(station, route.length)).pieces
    return (*pieces[:-1], replace(pieces[-1], end=start))

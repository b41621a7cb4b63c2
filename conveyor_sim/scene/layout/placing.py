# SPDX-License-Identifier: Apache-2.0
"""Places of conveyors: by coordinates, at the end of another, or beside it."""

from collections.abc import Iterator, Mapping

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.frames import PathFrame
from conveyor_sim.scene.layout.parts import Conveyor
from conveyor_sim.scene.layout.paths import route_by_moves, route_by_points
from conveyor_sim.scene.layout.plan import ConveyorPlan, Lane
from conveyor_sim.scene.layout.routes import Bend, Route
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH
from conveyor_sim.scene.words import listed, shown

_PLACED_BY: Mapping[str, tuple[str, ...]] = {
    "start": ("heading",),
    "after": ("back", "gap", "offset", "plate"),
    "beside": ("side", "from", "gap", "plate"),
    "points": ("radius",),
}
"""Fields that place a conveyor, each with the fields that go with it."""


def dependency(conveyor: Conveyor) -> str | None:
    """Return the name of the conveyor that this one is placed by; None if it is placed by coordinates."""
    return conveyor.after if conveyor.after is not None else conveyor.beside


def in_order(conveyors: Mapping[str, Conveyor]) -> Iterator[str]:
    """Yield names so that each follows the one that it is placed by. Those of circles come first."""
    done: set[str] = set()
    for first in conveyors:
        chain: dict[str, None] = {}
        name: str | None = first
        while name is not None and name in conveyors and name not in done and name not in chain:
            chain[name] = None
            name = dependency(conveyors[name])
        yield from reversed(chain)
        done.update(chain)


def circle(name: str, conveyors: Mapping[str, Conveyor]) -> list[str]:
    """Return the names of a circle of conveyors that are placed by each other, from `name` on; empty without one."""
    names = {name: None}
    after = dependency(conveyors[name])
    while after is not None and after in conveyors and after not in names:
        names[after] = None
        after = dependency(conveyors[after])
    return [*names, name] if after == name else []


def lanes_of(conveyor: Conveyor, path: Path) -> tuple[Lane, ...]:
    """Return the lanes of a conveyor from right to left, both edges equally far from its path. Raise LayoutFault."""
    if (conveyor.width is None) == (conveyor.lanes is None):
        if conveyor.width is None:
            raise LayoutFault((*path, "width"), "missing, expected a number greater than 0 (m), or lanes")
        raise LayoutFault((*path, "width"), f"{shown(conveyor.width)} given, expected either width or lanes")
    strips = [(lane.width, lane.ratio) for lane in conveyor.lanes or ()] or [(conveyor.width or 0.0, 1.0)]
    total = 0.0
    for width, _ in strips:
        total += width
    if total > COORDINATE_LIMIT:
        field = "width" if conveyor.lanes is None else "lanes"
        text = f"{total:.6g} m of width given, expected at most {COORDINATE_LIMIT:.0f} (m)"
        raise LayoutFault((*path, field), text)
    lanes, right = [], -0.5 * total
    for width, ratio in strips:
        lanes.append(Lane(right, width, ratio))
        right = lanes[-1].left
    return tuple(lanes)


def route_of_conveyor(
    conveyor: Conveyor, lanes: tuple[Lane, ...], plans: Mapping[str, ConveyorPlan], path: Path
) -> Route:
    """Return the path of a conveyor that is placed by coordinates, or by one in `plans`. Raise LayoutFault."""
    _check_fields(conveyor, path)
    if conveyor.points is not None:
        route = route_by_points(conveyor.points, conveyor.radius, path)
    else:
        if conveyor.path is None:
            raise LayoutFault((*path, "path"), "missing, expected a list of pieces, or points with a radius")
        route = route_by_moves(_start(conveyor, lanes, plans, path), conveyor.path, (*path, "path"))
    half = 0.5 * (lanes[-1].left - lanes[0].right)
    for index, piece in enumerate(route.pieces):
        if isinstance(piece, Bend) and piece.radius < half - TOUCH:
            field: Path = ("radius",) if conveyor.points is not None else ("path", index, "radius")
            text = f"{shown(piece.radius)} given, expected at least half the width, {half:.6g} (m)"
            raise LayoutFault((*path, *field), text)
    return route


def _check_fields(conveyor: Conveyor, path: Path) -> None:
    """Raise LayoutFault unless the fields say in exactly one way where a conveyor is."""
    given = conveyor.model_dump(by_alias=True, exclude_none=True, include={*_FIELDS, "from_"})
    ways = [field for field in _PLACED_BY if field in given]
    if len(ways) != 1:
        text = f"{' and '.join(ways) or 'no place'} given, expected one of {listed(list(_PLACED_BY))}"
        raise LayoutFault(path, text)
    for field in given:
        if field not in (*ways, *_PLACED_BY[ways[0]]):
            places = [way for way, fields in _PLACED_BY.items() if field in fields]
            text = f"{shown(given[field])} given, expected it only with {listed(places)}"
            raise LayoutFault((*path, field), text)
    if conveyor.points is not None and conveyor.path is not None:
        raise LayoutFault((*path, "path"), "given with points, expected one of them")
    if conveyor.beside is not None and conveyor.side is None:
        raise LayoutFault((*path, "side"), 'missing, expected "left" or "right"')
    if conveyor.back and conveyor.gap:
        raise LayoutFault((*path, "gap"), f"{shown(conveyor.gap)} given, expected none with back")
    if conveyor.plate is not None and not conveyor.gap:
        raise LayoutFault((*path, "gap"), "missing, expected the length of the gap that the plate fills (m)")


_FIELDS = {*_PLACED_BY, *(field for fields in _PLACED_BY.values() for field in fields)}


def _start(conveyor: Conveyor, lanes: tuple[Lane, ...], plans: Mapping[str, ConveyorPlan], path: Path) -> PathFrame:
    if conveyor.start is not None:
        return PathFrame(*conveyor.start, conveyor.heading or 0.0)
    way = "after" if conveyor.after is not None else "beside"
    other = plans[str(dependency(conveyor))]
    route, gap = other.route, conveyor.gap or 0.0
    if way == "after":
        back, offset = conveyor.back or 0.0, conveyor.offset or 0.0
        if back > route.length:
            text = f"{shown(back)} given, expected at most the length of {other.name}, {route.length:.6g} (m)"
            raise LayoutFault((*path, "back"), text)
        frame = (route.frame(route.length - back) if back else route.end).moved(gap, offset)
        return _within(frame, (*path, "gap" if gap else "offset"))
    station = conveyor.from_ or 0.0
    if station > route.length:
        text = f"{shown(station)} given, expected at most the length of {other.name}, {route.length:.6g} (m)"
        raise LayoutFault((*path, "from"), text)
    left = other.edges[1] + gap - lanes[0].right if conveyor.side == "left" else other.edges[0] - gap - lanes[-1].left
    return _within(route.frame(station).moved(0.0, left), (*path, "gap"))


def _within(frame: PathFrame, path: Path) -> PathFrame:
    if not max(map(abs, frame.xy)) <= COORDINATE_LIMIT:
        raise LayoutFault(path, f"leads to {shown(frame.xy)}, expected a place within +-{COORDINATE_LIMIT:.0f} (m)")
    return frame

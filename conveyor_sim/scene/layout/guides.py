# SPDX-License-Identifier: Apache-2.0
"""Guides of a layout: rails on both sides of conveyors or of a line through points."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.guide_line import guide_line
from conveyor_sim.scene.layout.joined import JoinedRoute, joined
from conveyor_sim.scene.layout.parts import Conveyor, Guide, GuideSides
from conveyor_sim.scene.layout.plan import SIDES, ConveyorPlan, GuideProfile, LayoutPlan, Side
from conveyor_sim.scene.layout.profile_rails import rails_along
from conveyor_sim.scene.layout.routes import Route, Straight
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH, XY
from conveyor_sim.scene.words import shown, some_of


@dataclass(frozen=True)
class GuideRail:
    """A rail of a guide, without its name and material."""

    side: Side
    data: dict[str, Any]
    source: Path
    """Path of the field that it comes from."""


def rails_of_conveyor(conveyor: Conveyor, plan: ConveyorPlan, order: Iterable[str], path: Path) -> Iterator[GuideRail]:
    """Yield the rails of a conveyor's own guides, and enter the guides in its plan. path: of the guides.

    order: names of the guides' fields as written, because the sides follow the file.

    Guides at a clearance also cover the gap in front of the conveyor. Raise LayoutFault.
    """
    guides = conveyor.guides
    if guides is None:
        return
    route, gap = plan.route, conveyor.gap or 0.0
    before = gap if conveyor.after is not None and guides.clearance is not None and not guides.from_ else 0.0
    if before:
        start = route.start.moved(-before)
        route = Route((Straight(start, route.start, before), *route.pieces))
    places = ((plan, before, route.length),)
    yield from _rails_along(guides, JoinedRoute(route, places), before, order, path)


def rails_of_guide(guide: Guide, layout: LayoutPlan, order: Iterable[str], path: Path) -> Iterator[GuideRail]:
    """Yield the rails of a guide, and enter it in the plans of its conveyors. Raise LayoutFault.

    order: names of its fields as written, because the sides follow the file.
    """
    if (guide.along is None) == (guide.points is None):
        text = "neither" if guide.along is None else "both"
        raise LayoutFault(path, f"{text} given, expected either along or points")
    if guide.points is not None:
        yield from _rails_by_points(guide, guide.points, layout, path)
        return
    plans = layout.conveyors
    for index, name in enumerate(guide.conveyors):
        if name in guide.conveyors[:index]:
            raise LayoutFault((*path, "along", index), f"{shown(name)} given, expected each conveyor once")
        if name not in plans:
            place: Path = ("along",) if isinstance(guide.along, str) else ("along", index)
            text = f"{shown(name)} given, expected a name from conveyors: {some_of(plans) or 'none'}"
            raise LayoutFault((*path, *place), text)
    yield from _rails_along(
        guide, joined([plans[name] for name in guide.conveyors], (*path, "along")), 0.0, order, path
    )


def _rails_along(
    guide: GuideSides, way: JoinedRoute, shift: float, order: Iterable[str], path: Path
) -> Iterator[GuideRail]:
    """Yield the rails of a guide along a path. shift: station of the path where stations of the guide begin (m)."""
    profiles: list[GuideProfile] = []
    for side in sorted(_sides(guide, path), key=[*(name for name in order if name in SIDES), *SIDES].index):
        corners = guide.corners(side)
        field: Path = ("clearance",) if corners is None else (side,)
        if corners is None:
            half = 0.5 * (guide.clearance or 0.0)
            if half > COORDINATE_LIMIT:
                text = f"{shown(guide.clearance)} given, expected at most {2 * COORDINATE_LIMIT:.0f} (m)"
                raise LayoutFault((*path, "clearance"), text)
            corners = ((0.0 - shift, half if side == "left" else -half),)
        else:
            _check_corners(corners, way.route.length, (*path, side))
        first, last = _stretch(guide, corners[0][0], way.route.length - shift, path)
        moved = tuple((s + shift, offset) for s, offset in corners)
        profile = GuideProfile(side, moved, first + shift, last + shift)
        for other in profiles:
            _check_order({side: profile, other.side: other}, shift, path)
        profiles.append(profile)
        parts = [(begin + shift, end + shift) for begin, end in _closed(guide, side, first, last, path)]
        for data in rails_along(way.route, profile, parts, (*path, *field)):
            yield GuideRail(side, data, (*path, *field))
        for plan, begin, end in way.places:
            within = replace(profile, begin=max(profile.begin, begin), end=min(profile.end, end), shift=begin)
            if within.begin < within.end:
                plan.guides.append(within)


def _rails_by_points(guide: Guide, points: tuple[XY, ...], layout: LayoutPlan, path: Path) -> Iterator[GuideRail]:
    for side in SIDES:
        if guide.corners(side) is not None:
            raise LayoutFault((*path, side), "given with points, expected clearance only")
    if guide.clearance is None:
        raise LayoutFault((*path, "clearance"), "missing, expected a number greater than 0 (m)")
    for side in SIDES:
        line = guide_line(points, side, 0.5 * guide.clearance, (*path, "points"))
        first, last = _stretch(guide, 0.0, line.stations[-1], path)
        for data in line.rails(_closed(guide, side, first, last, path)):
            yield GuideRail(side, data, (*path, "points"))
        for plan in layout.near(line.box):
            plan.guides.append(line)


def _sides(guide: GuideSides, path: Path) -> Sequence[Side]:
    """Return the sides that a guide has."""
    given = [side for side in SIDES if guide.corners(side) is not None]
    if bool(given) == (guide.clearance is not None):
        text = "clearance given" if given else "no place given"
        raise LayoutFault(path, f"{text}, expected either clearance, or corners of left, of right or of both")
    return given or SIDES


def _check_corners(corners: Sequence[XY], length: float, path: Path) -> None:
    """Raise LayoutFault unless the stations of corners grow, from 0 to the length of the path (m)."""
    least = 0.0
    for index, (s, offset) in enumerate(corners):
        if abs(offset) > COORDINATE_LIMIT:
            text = f"{shown((s, offset))} given, expected an offset within +-{COORDINATE_LIMIT:.0f} (m)"
            raise LayoutFault((*path, index), text)
        if not least <= s <= length + TOUCH:
            text = f"{shown((s, offset))} given, expected a station from {least:.6g} to {length:.6g} (m)"
            raise LayoutFault((*path, index), text)
        least = s + _APART


def _check_order(sides: Mapping[Side, GuideProfile], shift: float, path: Path) -> None:
    """Raise LayoutFault where the left side of a guide lies to the right of its right side. shift: as above."""
    left, right = sides["left"], sides["right"]
    begin, end = max(left.begin, right.begin), min(left.end, right.end)
    for s in sorted({begin, end, *(station for station, _ in (*left.corners, *right.corners))}):
        if begin <= s <= end and left.offset(s) < right.offset(s) - TOUCH:
            text = f"the offset is {left.offset(s):.6g} m at station {s - shift:.6g} m"
            raise LayoutFault((*path, "left"), f"{text}, expected at least that of right, {right.offset(s):.6g} m")


def _stretch(guide: GuideSides, first: float, length: float, path: Path) -> XY:
    """Return the stations where a guide begins and ends (m)."""
    if guide.to is not None and not guide.to <= length + TOUCH:
        text = f"{shown(guide.to)} given, expected at most the length of the path, {length:.6g} (m)"
        raise LayoutFault((*path, "to"), text)
    begin = first if guide.from_ is None else max(first, guide.from_)
    end = length if guide.to is None else min(guide.to, length)
    if end - begin < _APART:
        field = "from" if guide.to is None and guide.from_ is not None else "to"
        raise LayoutFault(
            (*path, field),
            f"the guide begins at {begin:.6g} m and ends at {end:.6g} m, expected its end beyond its start",
        )
    return begin, end


def _closed(guide: GuideSides, side: Side, first: float, last: float, path: Path) -> list[XY]:
    """Return the parts of a side without its openings, each first and last station (m)."""
    openings = guide.open.left if side == "left" else guide.open.right
    parts, begin = [], first
    for index, (low, high) in enumerate(sorted(openings)):
        if not (first - TOUCH <= low < high <= last + TOUCH):
            index = openings.index((low, high))
            text = f"{shown((low, high))} given, expected two stations from {max(first, 0.0):.6g} to {last:.6g} (m)"
            raise LayoutFault((*path, "open", side, index), f"{text}, the smaller one first")
        if low - begin >= _APART:
            parts.append((begin, low))
        begin = max(begin, high)
    if last - begin >= _APART:
        parts.append((begin, last))
    if not parts:
        raise LayoutFault((*path, "open", side), "leaves nothing of the guide, expected none of it open")
    return parts


_APART = 1e-6
"""Least distance of two corners, and least length of a rail (m)."""

# SPDX-License-Identifier: Apache-2.0
"""Devices along conveyors: their places become coordinates."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from conveyor_sim.scene.layout import barriers, entries
from conveyor_sim.scene.layout.along import (
    Along,
    AlongAdjustable,
    AlongClamp,
    AlongDiverter,
    AlongDivider,
    AlongLift,
    AlongLine,
    AlongPoint,
    AlongPusher,
    AlongRail,
    AlongRegion,
    AlongSlide,
    AlongSlidingDivider,
    AlongSwing,
)
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.plan import LayoutPlan
from conveyor_sim.scene.layout.routes import Bend, Route
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.layout.wheels import AlongScrew, AlongSideBelt, AlongStar, line_along, star
from conveyor_sim.scene.part import Part, validated
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.movers import (
    AdjustableGuide,
    Clamp,
    Diverter,
    LiftingGate,
    Pusher,
    SlidingDivider,
    SlidingGate,
    SwingingDivider,
    SwingingGate,
)
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.photo_eye import PhotoEye
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.parts.screw import Screw
from conveyor_sim.scene.parts.side_belt import SideBelt
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.parts.spill import Spill
from conveyor_sim.scene.parts.star import Star
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.parts.zone import Zone
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.rails import SegmentRail
from conveyor_sim.scene.schema import GridOfBottles, Single
from conveyor_sim.scene.types import TOUCH, XY
from conveyor_sim.scene.words import did_you_mean, field_names, shown, some_of

_CHORD = math.radians(7.5)
"""Largest angle of a chord. It is up to 0.2 % of the radius off the arc."""


def region(site: Site[AlongRegion]) -> list[Coordinate]:
    """Return the region of a device as a polygon; arcs become chords. Raise LayoutFault."""
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


Coordinates = Callable[[Site[Any], Mapping[str, Any]], list[Coordinate]]
"""Returns fields in coordinates from a site and the device as written."""


@dataclass(frozen=True)
class Placeable:
    """A kind of device that can be placed along a conveyor."""

    field: str
    """Field of the scene."""
    part: type[Part]
    """Device in coordinates."""
    place: type[Along]
    """Fields of its place along a conveyor."""
    instead: tuple[str, ...]
    """Fields of the device that the place replaces."""
    kind: str | None = None
    """Its `kind`."""
    within: str | None = None
    """Field of the device that holds the place; None: the device itself."""
    coordinates: Coordinates | None = None
    """Function that returns the fields in coordinates; None for rails, which may become several."""


def _device(
    field: str,
    part: type[Part],
    place: type[Along],
    instead: tuple[str, ...],
    coordinates: Callable[[Site[Any]], list[Coordinate]],
    kind: str | None = None,
) -> Placeable:
    return Placeable(field, part, place, instead, kind, None, lambda site, device: coordinates(site))


_ENDS, _REGION, _ENTRY = ("from", "to"), ("region",), ("position", "direction")
RAIL = Placeable("rails", SegmentRail, AlongRail, ("kind", *_ENDS))
BOTTLE = _device("bottles", Single, AlongPoint, ("position",), entries.position)
GRID = _device("bottles", GridOfBottles, AlongPoint, ("origin", "angle"), entries.grid)
DEVICES = (
    _device("gates", SlidingGate, AlongSlide, (*_ENDS, "direction"), barriers.sliding_gate, "slide"),
    _device("gates", SwingingGate, AlongSwing, _ENDS, barriers.swinging_gate, "swing"),
    _device("gates", LiftingGate, AlongLift, _ENDS, barriers.line, "lift"),
    _device("pushers", Pusher, AlongPusher, ("direction",), barriers.pusher),
    _device("diverters", Diverter, AlongDiverter, _ENDS, barriers.diverter),
    _device("dividers", SwingingDivider, AlongDivider, _ENDS, barriers.swinging_divider, "swing"),
    _device("dividers", SlidingDivider, AlongSlidingDivider, ("direction",), barriers.sliding_divider, "slide"),
    _device("adjustable", AdjustableGuide, AlongAdjustable, ("direction",), barriers.adjustable),
    _device("clamps", Clamp, AlongClamp, ("direction",), barriers.clamp),
    Placeable("stars", Star, AlongStar, ("centre", "turn", "entry"), coordinates=star),
    _device("screws", Screw, AlongScrew, (), line_along),
    _device("side_belts", SideBelt, AlongSideBelt, (), line_along),
    Placeable("infeeds", Infeed, AlongPoint, _ENTRY, coordinates=entries.entry),
    _device("outfeeds", Outfeed, AlongRegion, _REGION, region),
    Placeable("machines", Source, AlongPoint, _ENTRY, "source", coordinates=entries.entry),
    _device("machines", Sink, AlongRegion, _REGION, region, "sink"),
    _device("machines", Station, AlongRegion, _REGION, region, "station"),
    Placeable("machines", Station, AlongPoint, _ENTRY, "station", "out", entries.entry),
    _device("machines", Inspection, AlongLine, _ENDS, barriers.line, "inspection"),
    _device("machines", Reject, AlongRegion, _REGION, region, "reject"),
    _device("spills", Spill, AlongPoint, ("position",), entries.position),
    _device("photo_eyes", PhotoEye, AlongLine, _ENDS, barriers.line),
    _device("zones", Zone, AlongRegion, _REGION, region),
    _device("counters", Counter, AlongLine, _ENDS, barriers.line),
)
PLACEABLE = (RAIL, *DEVICES, BOTTLE, GRID)
"""Everything that can be placed along a conveyor, in the order of a scene's fields."""

_FIELDS = tuple(dict.fromkeys(device.field for device in DEVICES))


@dataclass
class Placement:
    """Devices of a scene while their places along conveyors become coordinates."""

    plan: LayoutPlan
    conveyors: Collection[str]
    """Names of all conveyors as written. One without a plan has separate problems."""
    scene: Mapping[str, Any] = field(default_factory=dict)
    """The scene with expanded conveyors."""
    sources: dict[Path, Path] = field(default_factory=dict)
    """Paths of places by paths of coordinates."""
    problems: list[Problem] = field(default_factory=list)

    def in_coordinates(self, scene: Mapping[str, Any]) -> dict[str, Any]:
        """Return a scene with expanded conveyors with coordinates for all places, except those of rails."""
        self.scene, result = scene, dict(scene)
        for name in _FIELDS:
            devices = scene.get(name)
            if isinstance(devices, Mapping) and any(map(is_placed, devices.values())):
                kinds = [kind for kind in DEVICES if kind.field == name]
                result[name] = {key: self._device((name, key), device, kinds) for key, device in devices.items()}
        if isinstance(bottles := scene.get("bottles"), list):
            result["bottles"] = [self._bottle(("bottles", index), entry) for index, entry in enumerate(bottles)]
        return result

    def rails(self, path: Path, rail: Mapping[str, Any]) -> list[tuple[dict[str, Any], Path]]:
        """Return the rails of an entry placed along a conveyor without their other fields, and the source of each."""
        names = field_names(RAIL.place)
        fields = {name: value for name, value in rail.items() if name in names}
        self._check_names(RAIL, path, rail, names)
        with self._noted():
            if (site := self._site(RAIL, path, fields)) is not None:
                return [(data, (*path, source)) for data, source in barriers.rails(site)]
        return []

    def _bottle(self, path: Path, entry: Any) -> Any:
        if isinstance(entry, Mapping) and "grid" in entry:
            return {**entry, "grid": self._device((*path, "grid"), entry["grid"], [GRID])}
        return self._device(path, entry, [BOTTLE])

    def _device(self, path: Path, device: Any, kinds: Sequence[Placeable]) -> Any:
        """Return a device with coordinates for its places, and note their sources and problems."""
        if not is_placed(device):
            return device
        own = [
            kind
            for kind in kinds
            if kind.kind in (None, device.get("kind"))
            and (kind.within in device if kind.within else "along" in device or "at" in device)
        ]
        places: set[str] = set()
        coordinates: dict[str, tuple[Any, Path]] = {}
        for kind in own:
            at, fields = path, device
            if kind.within is None:
                names = field_names(kind.place)
                places |= names.keys()
                fields = {name: value for name, value in device.items() if name in names}
            else:
                places.add(kind.within)
                at, fields = (*path, kind.within), device[kind.within]
            with self._noted():
                if (site := self._site(kind, at, fields)) is not None and kind.coordinates is not None:
                    for one in kind.coordinates(site, device):
                        coordinates[one.field] = (one.value, (*at, one.source))
        for kind in own:
            self._check_names(kind, path, device, places)
            if kind.part is Station and not {"out", "position"} & device.keys():
                self._problem((*path, "out"), "missing, expected the place where it gives bottles back: along and at")
        result = {name: value for name, value in device.items() if name not in places}
        for name, (value, source) in coordinates.items():
            # What a place gives by default, such as the speed, may be given as a field of the device.
            if name not in result:
                result[name] = value
                self.sources[(*path, name)] = source
        return result

    def _site(self, kind: Placeable, path: Path, fields: Any) -> Site[Any] | None:
        """Return the site of a place, None if it or its conveyor has problems. Raise LayoutFault.

        fields: of the place; path: of these fields.
        """
        place = validated(kind.place, fields)
        if isinstance(place, tuple):
            self.problems += [Problem((*path, *problem.path), problem.text) for problem in place[0]]
            return None
        if place.along not in self.conveyors:
            expected = f"a name from conveyors: {some_of(self.conveyors) or 'there are none'}"
            raise LayoutFault((*path, "along"), f"{shown(place.along)} given, expected {expected}")
        conveyor = self.plan.conveyors.get(place.along)
        return None if conveyor is None else Site(conveyor, place, fields, path, self.scene)

    @contextmanager
    def _noted(self) -> Iterator[None]:
        try:
            yield
        except LayoutFault as fault:
            self.problems.append(fault.problem)

    def _check_names(self, kind: Placeable, path: Path, device: Mapping[str, Any], places: Collection[str]) -> None:
        """Note problems of coordinates beside a place, and of unknown fields. places: names of fields of places.

        The check of the device in coordinates would come too late if a place has problems as well.
        """
        known = {*places, *field_names(kind.part)}
        for name in device:
            if name not in known:
                self._problem((*path, name), f"no such field, {did_you_mean(str(name), sorted(known))}")
            elif name in kind.instead and name not in places:
                way = kind.within or "along"
                self._problem((*path, name), f"{shown(device[name])} given, expected either {way} or {name}")

    def _problem(self, path: Path, text: str) -> None:
        if (problem := Problem(path, text)) not in self.problems:
            self.problems.append(problem)


_OF_PLACES = frozenset(("along", "at", "out"))
"""Fields that only devices along conveyors have. `at` alone lacks the name of the conveyor."""


def is_placed(device: Any) -> bool:
    """Return True if a device, as written, has a place along a conveyor."""
    return isinstance(device, Mapping) and not device.keys().isdisjoint(_OF_PLACES)


def has_places(scene: Mapping[str, Any]) -> bool:
    """Return True if a scene, as written, has devices along conveyors."""
    named = (scene.get(name) for name in ("rails", *_FIELDS))
    if any(any(map(is_placed, devices.values())) for devices in named if isinstance(devices, Mapping)):
        return True
    bottles = scene.get("bottles")
    entries_ = bottles if isinstance(bottles, list) else []
    return any(is_placed(entry) or (isinstance(entry, Mapping) and is_placed(entry.get("grid"))) for entry in entries_)

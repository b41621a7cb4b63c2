"""Devices along conveyors: their places become coordinates."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from conveyor_sim.scene.layout import barriers, entries
from conveyor_sim.scene.layout.along import (
    Along,
    AlongDiverter,
    AlongExit,
    AlongLine,
    AlongPoint,
    AlongPusher,
    AlongRegion,
    AlongSlide,
    AlongSwing,
)
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.plan import LayoutPlan
from conveyor_sim.scene.layout.regions import region
from conveyor_sim.scene.layout.site import Coordinate, Site
from conveyor_sim.scene.part import Part, validated
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.movers import Diverter, Pusher, SlidingGate, SwingingGate
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.photo_eye import PhotoEye
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.parts.spill import Spill
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.parts.zone import Zone
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.words import did_you_mean, field_names, shown, some_of


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
    coordinates: Callable[[Site[Any], Mapping[str, Any]], list[Coordinate]]
    """Returns the fields in coordinates. The device as written is the second argument."""
    kind: str | None = None
    """Its `kind`."""
    within: str | None = None
    """Field of the device that holds the place; None: the device itself."""


def _only(place: Callable[[Site[Any]], list[Coordinate]]) -> Callable[[Site[Any], Mapping[str, Any]], list[Coordinate]]:
    return lambda site, device: place(site)


_ENDS, _REGION, _ENTRY = ("from", "to"), ("region",), ("position", "direction")

PLACEABLE = (
    Placeable("gates", SlidingGate, AlongSlide, (*_ENDS, "direction"), _only(barriers.sliding_gate), "slide"),
    Placeable("gates", SwingingGate, AlongSwing, _ENDS, _only(barriers.swinging_gate), "swing"),
    Placeable("pushers", Pusher, AlongPusher, ("direction",), _only(barriers.pusher)),
    Placeable("diverters", Diverter, AlongDiverter, _ENDS, _only(barriers.diverter)),
    Placeable("infeeds", Infeed, AlongPoint, _ENTRY, entries.entry),
    Placeable("outfeeds", Outfeed, AlongRegion, _REGION, _only(region)),
    Placeable("machines", Source, AlongPoint, _ENTRY, entries.entry, "source"),
    Placeable("machines", Sink, AlongRegion, _REGION, _only(region), "sink"),
    Placeable("machines", Station, AlongRegion, _REGION, _only(region), "station"),
    Placeable("machines", Station, AlongExit, _ENTRY, entries.entry, "station", "out"),
    Placeable("machines", Inspection, AlongLine, _ENDS, _only(barriers.line), "inspection"),
    Placeable("machines", Reject, AlongRegion, _REGION, _only(region), "reject"),
    Placeable("spills", Spill, AlongPoint, ("position",), _only(entries.position)),
    Placeable("photo_eyes", PhotoEye, AlongLine, _ENDS, _only(barriers.line)),
    Placeable("zones", Zone, AlongRegion, _REGION, _only(region)),
    Placeable("counters", Counter, AlongLine, _ENDS, _only(barriers.line)),
)
"""Devices that can be placed along a conveyor, in the order of a scene's fields."""

_FIELDS = tuple(dict.fromkeys(placeable.field for placeable in PLACEABLE))


@dataclass
class Placement:
    """Devices in coordinates."""

    data: dict[str, Any]
    """The scene, with coordinates for places along conveyors."""
    sources: dict[Path, Path] = field(default_factory=dict)
    """Paths of places by paths of coordinates."""
    problems: list[Problem] = field(default_factory=list)


def is_placed(device: Any) -> bool:
    """Return True if a device, as written, has a place along a conveyor."""
    return isinstance(device, Mapping) and ("along" in device or "out" in device)


def place_devices(data: Mapping[str, Any], plan: LayoutPlan, known: Mapping[str, Any]) -> Placement:
    """Return a scene with coordinates for the places of devices along conveyors.

    data: the scene with expanded conveyors. known: conveyors as written; those without a plan have problems of their own.
    """
    result = Placement(dict(data))
    for field_name in _FIELDS:
        devices = data.get(field_name)
        if not isinstance(devices, Mapping) or not any(map(is_placed, devices.values())):
            continue
        placed = result.data[field_name] = dict(devices)
        for name, device in devices.items():
            if is_placed(device):
                one = _Device(data, plan, known, (field_name, name), device)
                placed[name] = one.in_coordinates()
                result.sources |= one.sources
                result.problems += one.problems
    return result


class _Device:
    """A device while it is placed."""

    def __init__(
        self, data: Mapping[str, Any], plan: LayoutPlan, known: Mapping[str, Any], path: Path, device: Mapping[str, Any]
    ) -> None:
        self._data, self._plan, self._known, self._path, self._device = data, plan, known, path, device
        self.sources: dict[Path, Path] = {}
        self.problems: list[Problem] = []

    def in_coordinates(self) -> dict[str, Any]:
        """Return the fields of the device in coordinates, and note sources and problems."""
        kinds = [one for one in PLACEABLE if one.field == self._path[0] and one.kind in (None, self._device.get("kind"))]
        result = dict(self._device)
        taken: set[str] = set()
        for kind in kinds:
            if ("along" if kind.within is None else kind.within) not in self._device:
                continue
            place = self._device if kind.within is None else self._device[kind.within]
            names = field_names(kind.place)
            if kind.within is None:
                taken.update(names)
                place = {name: value for name, value in place.items() if name in names}
            else:
                taken.add(kind.within)
            for coordinate in self._coordinates(kind, place):
                path: Path = () if kind.within is None else (kind.within,)
                # Fields of the device itself, such as `speed`, take precedence over defaults of the place.
                if coordinate.field not in self._device or coordinate.field in names:
                    ...
        return result

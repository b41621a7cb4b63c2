"""JSON Schema of devices along conveyors: fields of a place instead of coordinates."""

from collections.abc import Iterable
from itertools import combinations
from typing import Any

from conveyor_sim.scene.layout.devices import PLACEABLE, Placeable

Node = dict[str, Any]

PLACES = tuple(dict.fromkeys(kind.place for kind in PLACEABLE))
"""Parts whose definitions `placed_devices` needs."""

_GIVEN_BY_PLACE = ("speed",)
"""Required fields of a device that have a default along a conveyor."""


def placed_devices(definitions: dict[str, Node]) -> dict[str, dict[str, Node]]:
    """Return the definitions of all devices along conveyors, by the name of the definition of the device."""
    kinds: dict[str, list[Placeable]] = {}
    for kind in PLACEABLE:
        kinds.setdefault(kind.part.__name__, []).append(kind)
    return {
        part: {f"{part}_{_suffix(some)}": _placed(definitions, part, some) for some in _choices(own)}
        for part, own in kinds.items()
    }


def _choices(kinds: list[Placeable]) -> Iterable[tuple[Placeable, ...]]:
    """Yield the places that a device may have together."""
    for count in range(1, len(kinds) + 1):
        yield from combinations(kinds, count)


def _suffix(kinds: tuple[Placeable, ...]) -> str:
    return "_".join(kind.within or "along" for kind in kinds)


def _placed(definitions: dict[str, Node], part: str, kinds: tuple[Placeable, ...]) -> Node:
    device = definitions[part]
    properties, required = dict(device["properties"]), list(device.get("required", []))
    for kind in kinds:
        place = definitions[kind.place.__name__]
        own = {kind.within: place} if kind.within else place["properties"]
        needed = [kind.within] if kind.within else place.get("required", [])
        replaced = {*kind.instead, *own, *_GIVEN_BY_PLACE}
        properties = {name: field for name, field in properties.items() if name not in kind.instead} | own
        required = [*(name for name in required if name not in replaced), *needed]
    return {**device, "properties": properties, "required": required}

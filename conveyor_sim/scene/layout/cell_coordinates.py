# SPDX-License-Identifier: Apache-2.0
"""Placing of a cell: its coordinates, turned and shifted to where the cell stands in the scene."""

from collections.abc import Iterator, Mapping
from typing import Any

from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.layout.fragments import SHARED
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.quantities import to_si
from conveyor_sim.scene.types import XY

POINTS = ("centre", "from", "origin", "position", "start", "to")
"""Fields that hold a point [x, y]; one number in such a field is a time or a station."""
POINT_LISTS = ("points", "region")
"""Fields that hold a list of points."""
DIRECTIONS = ("angle", "direction", "entry", "heading", "start_angle")
"""Fields that hold a direction in the plan."""
VECTORS = ("velocity",)
"""Fields that hold a vector [vx, vy]."""
RELATIVE = ("diverters", "gates")
"""Fields of a scene whose parts have an `angle` by which they swing, not a direction."""
_WITHOUT = ("after", "along", "beside")
"""Fields of parts that are placed by another part. Their lists of points are not coordinates."""


def coordinates(data: Mapping[Any, Any]) -> Iterator[tuple[Path, str, Any]]:
    """Yield the path, kind ("point", "direction" or "vector") and value of each coordinate of a cell's data."""
    for field, parts in data.items():
        if field == SHARED:
            continue
        items = parts.items() if isinstance(parts, dict) else enumerate(parts) if isinstance(parts, list) else ()
        for name, part in items:
            yield from _of_part((field, name), part)


def _of_part(path: Path, part: Any) -> Iterator[tuple[Path, str, Any]]:
    if not isinstance(part, dict):
        return
    placed = any(key in part for key in _WITHOUT)
    for key, value in part.items():
        at = (*path, key)
        if key in POINTS and _is_pair(value):
            yield at, "point", value
        elif key in POINT_LISTS and isinstance(value, list) and not placed:
            yield from (((*at, index), "point", item) for index, item in enumerate(value) if _is_pair(item))
        elif key in DIRECTIONS and not isinstance(value, (dict, list)):
            if not (key == "angle" and path[0] in RELATIVE):
                yield at, "direction", value
        elif key in VECTORS and _is_pair(value):
            yield at, "vector", value
        elif isinstance(value, dict):
            yield from _of_part(at, value)
        elif isinstance(value, list):
            for index, item in enumerate(value):
                yield from _of_part((*at, index), item)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and not any(isinstance(item, (dict, list)) for item in value)


def placed(data: dict[Any, Any], start: XY, heading: float) -> dict[Any, Any]:
    """Return the data of a cell whose origin is at `start` (m), turned by `heading` (rad).

    Coordinates that are no quantities stay as they are; they are refused with the other fields of their part.
    """
    if start == (0.0, 0.0) and heading == 0.0:
        return data
    cos, sin = unit_vector(heading)
    data = _copied(data)
    for path, kind, value in list(coordinates(data)):
        try:
            if kind == "direction":
                _set(data, path, si(value, "rad") + heading)
                continue
            x, y = (si(item, "m" if kind == "point" else "m/s") for item in value)
        except ValueError:
            continue
        turned = x * cos - y * sin, x * sin + y * cos
        origin = start if kind == "point" else (0.0, 0.0)
        _set(data, path, [turned[0] + origin[0], turned[1] + origin[1]])
    return data


def si(value: Any, unit: str) -> float:
    """Return a number in SI units. Raise ValueError."""
    if isinstance(value, str):
        return to_si(value, unit)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return value
    raise ValueError("expected a number or a quantity with its unit")


def _copied(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    return [_copied(item) for item in value] if isinstance(value, list) else value


def _set(data: Any, path: Path, value: Any) -> None:
    for key in path[:-1]:
        data = data[key]
    data[path[-1]] = value

# SPDX-License-Identifier: Apache-2.0
"""Site of a device along a conveyor: stations and widths in numbers, while the device is placed."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

from conveyor_sim.scene.layout.along import Along
from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.plan import ConveyorPlan, Side
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH, XY
from conveyor_sim.scene.words import shown

_NEGATIVE = re.compile(
    r"\s*[-\u2212]\s*[0-9.][0-9. \u00a0\u2009\u202f]*(?:[eE][-+]?[0-9]+)?\s*[A-Za-z\u00b5\u03bc]*\s*"
)
"""A negative number with or without a unit. Other texts are expressions."""

A = TypeVar("A", bound=Along)


class Coordinate(NamedTuple):
    """A field of a device in coordinates, and the field of its place that it comes from."""

    field: str
    value: Any
    source: str


@dataclass(frozen=True)
class Site(Generic[A]):
    """A device along a conveyor."""

    conveyor: ConveyorPlan
    place: A
    raw: Mapping[str, Any]
    """Fields of the place as written."""
    path: Path
    """Path of these fields in the scene."""
    scene: Mapping[str, Any]
    """Expanded data of the scene."""

    def station(self, field: str = "at") -> float:
        """Return the station (m) in a field. Raise LayoutFault if it is beyond the conveyor.

        A negative number counts from the end, the negative result of an expression does not.
        """
        raw = self.raw[field]
        value: Any = getattr(self.place, "from_" if field == "from" else field)
        length = self.conveyor.route.length
        if value == "end":
            return length
        s = length + value if value < 0.0 and _is_literal(raw) else value
        if not -TOUCH <= s <= length + TOUCH:
            result = f", which is {value:.6g} m" if isinstance(raw, str) else ""
            raise LayoutFault(
                (*self.path, field),
                f"{shown(raw)} given{result}, expected a station from 0 to {length:.6g} m, "
                f"the length of conveyor {self.conveyor.name}",
            )
        return float(min(max(s, 0.0), length))

    def stretch(self) -> tuple[float, float, str]:
        """Return first and last station (m) of a place by `at` and `length` or by `from` and `to`, and its first field.

        Raise LayoutFault if it is given in another way, or has no length.
        """
        names = [name for name in ("at", "length", "from", "to") if self.raw.get(name) is not None]
        if names == ["at", "length"]:
            end = self.station("at")
            length: float = self.place.length  # type: ignore[attr-defined]
            if length > end + TOUCH:
                text = f"{shown(self.raw['length'])} given, expected at most {end:.6g} m, the station of its end"
                raise LayoutFault((*self.path, "length"), text)
            return max(end - length, 0.0), end, "at"
        if not names or not set(names) <= {"from", "to"}:
            text = f"{' and '.join(names) or 'no station'} given, expected either at and length, or from and to"
            raise LayoutFault(self.path, text)
        begin = self.station("from") if "from" in names else 0.0
        end = self.station("to") if "to" in names else self.conveyor.route.length
        if end - begin <= TOUCH:
            text = f"{shown(self.raw[names[-1]])} given, expected its end, {end:.6g} m, beyond its start, {begin:.6g} m"
            raise LayoutFault((*self.path, names[-1]), text)
        return begin, end, names[0]

    def point(self, s: float, offset: float) -> list[float]:
        """Return the point at a station and an offset (m). Raise LayoutFault if it is too far away for a scene."""
        return self.within_limits(self.conveyor.route.point(s, offset))

    def within_limits(self, point: XY) -> list[float]:
        """Return a point (m). Raise LayoutFault if it is too far away for a scene."""
        if max(map(abs, point)) <= COORDINATE_LIMIT:
            return list(point)
        text = f"lies at {shown(point)}, expected a place within +-{COORDINATE_LIMIT:.0f} (m)"
        raise LayoutFault(self.path, text)

    def across(self, s: float) -> XY:
        """Return the signed offsets (m) of the right and the left end of a line across. Raise LayoutFault."""
        place: Any = self.place
        right, left = self.clear(s) if place.width is None else (-0.5 * place.width, 0.5 * place.width)
        right, left = right + place.offset - place.extend, left + place.offset + place.extend
        if left - right <= TOUCH:
            field = "extend" if "extend" in self.raw else "at"
            text = f"{shown(self.raw[field])} given, expected a line longer than 0 ({left - right:.6g} m)"
            raise LayoutFault((*self.path, field), text)
        return right, left

    def clear(self, s: float) -> XY:
        """Return the signed offsets (m) of the right and the left end of the clear width. Raise LayoutFault."""
        right, left = self.conveyor.clear(s)
        if left - right <= TOUCH:
            text = f"the guides leave {left - right:.6g} m at {s:.6g} m, expected a station with a clear width"
            raise LayoutFault(self.path, text)
        return right, left

    def edge(self, s: float, side: Side) -> float:
        """Return the signed offset (m) of one end of the clear width. Raise LayoutFault."""
        return self.clear(s)[side == "left"]


def _is_literal(raw: Any) -> bool:
    return not isinstance(raw, str) or _NEGATIVE.fullmatch(raw) is not None

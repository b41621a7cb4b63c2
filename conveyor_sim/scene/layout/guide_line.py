# SPDX-License-Identifier: Apache-2.0
"""Guides on both sides of a line through points: offset polylines with mitred corners."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.paths import SHORTEST, vectors
from conveyor_sim.scene.layout.plan import Box, ConveyorPlan, Side, box_of
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import COORDINATE_LIMIT, TOUCH, XY
from conveyor_sim.scene.words import shown


@dataclass(frozen=True)
class GuideLine:
    """One side of a guide: corners with their stations along the middle (m)."""

    side: Side
    stations: tuple[float, ...]
    points: tuple[XY, ...]

    @property
    def box(self) -> Box:
        """Box that holds it."""
        return box_of(self.points)

    def point(self, s: float) -> XY:
        """Return the point at a station (m); beyond the ends, the end."""
        for (s0, s1), ((x0, y0), (x1, y1)) in zip(pairwise(self.stations), pairwise(self.points), strict=True):
            if s <= s0:
                return x0, y0
            if s < s1:
                share = (s - s0) / (s1 - s0)
                return x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        return self.points[-1]

    def rails(self, parts: Sequence[XY]) -> Iterator[dict[str, Any]]:
        """Yield the geometry of a rail for each part, first and last station (m)."""
        for first, last in parts:
            places = zip(self.stations, self.points, strict=True)
            inside = [point for s, point in places if first + TOUCH < s < last - TOUCH]
            corners = [self.point(first), *inside, self.point(last)]
            yield {"kind": "polyline", "points": [list(point) for point in corners]}

    def offset_on(self, conveyor: ConveyorPlan, s: float) -> float | None:
        """Return the offset (m) where it crosses a conveyor at a station (m); None if it doesn't.

        A guide on the left counts from the right edge up to half a width beyond the left edge.
        """
        frame = conveyor.route.frame(s)
        right, left = conveyor.edges
        beyond = 0.5 * (left - right)
        low, high = (right, left + beyond) if self.side == "left" else (right - beyond, left)
        offsets = []
        for (along0, left0), (along1, left1) in pairwise(map(frame.seen_from, self.points)):
            if min(along0, along1) <= 0.0 <= max(along0, along1) and along0 != along1:
                offset = left0 + (left1 - left0) * (along0 / (along0 - along1))
                if low < offset < high:
                    offsets.append(offset)
        return min(offsets, key=abs, default=None)


def guide_line(points: tuple[XY, ...], side: Side, distance: float, path: Path) -> GuideLine:
    """Return one side of a guide at a distance (m) from a line through points. path: of the points.

    Raise LayoutFault if a corner is too sharp for it.
    """
    directions, stations = [], [0.0]
    for dx, dy, length in vectors(points, path):
        directions.append((dx / length, dy / length))
        stations.append(stations[-1] + length)
    left = distance if side == "left" else -distance
    corners = []
    for index, (x, y) in enumerate(points):
        (ax, ay), (bx, by) = directions[max(index - 1, 0)], directions[min(index, len(directions) - 1)]
        # The mitre lies along the sum of both normals, and is longer than `left` by 1 / cos(half the turn).
        stretch = 1.0 + ax * bx + ay * by
        if stretch < _SHARPEST:
            raise LayoutFault((*path, index), f"{shown((x, y))} given, expected a line that doesn't turn back")
        corners.append((x - left * (ay + by) / stretch, y + left * (ax + bx) / stretch))
    for index, ((x0, y0), (x1, y1)) in enumerate(pairwise(corners)):
        dx, dy = directions[index]
        if (x1 - x0) * dx + (y1 - y0) * dy < SHORTEST:
            sharp = index if index else index + 1
            raise LayoutFault(
                (*path, sharp), f"{shown(points[sharp])} given, expected a corner that leaves room for the {side} guide"
            )
    for index, (x, y) in enumerate(corners):
        if not max(abs(x), abs(y)) <= COORDINATE_LIMIT:
            text = f"{shown(points[index])} given, expected a guide within +-{COORDINATE_LIMIT:.0f} (m)"
            raise LayoutFault((*path, index), text)
    return GuideLine(side, tuple(stations), tuple(corners))


_SHARPEST = 0.01
"""1 + cosine of the sharpest turn: 172 degrees, where a mitre is 14 times as long as the distance."""

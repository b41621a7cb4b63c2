# SPDX-License-Identifier: Apache-2.0
"""Track of one traced bottle: its places so far, and whether it has stopped, left the belts or come back."""

from __future__ import annotations

import math

import numpy as np

from conveyor_sim.report.flow.surfaces import NONE, Indices, SurfaceMap
from conveyor_sim.scene.geometry import Array
from conveyor_sim.scene.types import XY

CHUNK = 50
"""Ticks between two looks at the bottles."""

STILL = 0.02
"""Way over radius below which a bottle has stopped within a chunk."""

ASTRAY = 0.5
"""m without a surface after which a bottle has left the line."""

LOOP = 8.0
"""Shortest way round a loop over radius."""

SAME = 0.6
"""Distance over radius at which a bottle is back at an earlier place."""


class Track:
    """Places of a bottle at ticks. `add` takes a chunk of ticks; the other methods look at the last chunk."""

    def __init__(self, start: XY, radius: float, surfaces: SurfaceMap) -> None:
        self._surfaces, self._radius = surfaces, radius
        self._chunks = [np.array([start])]
        self._carriers = [surfaces.under(self._chunks[0])]
        self._count, self._way = 1, 0.0
        self._last_on = 0, self._chunks[0][0]
        self._astray: tuple[int, int] | None = None
        self._marks: dict[tuple[int, int], list[tuple[float, Array, Array]]] = {}

    def add(self, chunk: Array) -> None:
        """Append the places at further ticks, (k, 2)."""
        carriers = self._surfaces.under(chunk)
        for place, point in enumerate(chunk):
            if carriers[place] != NONE:
                self._last_on = self._count + place, point
            elif self._astray is None and math.dist(self._last_on[1], point) > ASTRAY:
                self._astray = self._last_on[0] + 2, self._count + place
        self._chunks.append(chunk)
        self._carriers.append(carriers)
        self._count += len(chunk)

    @property
    def before(self) -> int:
        """Number of places before the last chunk."""
        return self._count - len(self._chunks[-1])

    @property
    def chunk(self) -> Array:
        """Places of the last chunk, (k, 2)."""
        return self._chunks[-1]

    @property
    def carried(self) -> bool:
        """True if the last place is on a surface."""
        return int(self._carriers[-1][-1]) != NONE

    def path(self, count: int | None = None) -> tuple[Array, Indices]:
        """Return the first places, (count, 2), and the surface under each, (count,); None: all."""
        return np.vstack(self._chunks)[:count], np.concatenate(self._carriers)[:count]

    def cut(self, count: int) -> None:
        """Forget all places but the first."""
        points, carriers = self.path(count)
        self._chunks, self._carriers, self._count = [points], [carriers], count

    def stopped(self) -> int | None:
        """Return the number of places up to the stop of a bottle, None if it moves or the chunk is short."""
        if len(self.chunk) < CHUNK or np.hypot(*(self.chunk - self.chunk[-1]).T).max() >= STILL * self._radius:
            return None
        points, _ = self.path()
        moving = np.flatnonzero(np.hypot(*(points - points[-1]).T) >= STILL * self._radius)
        return int(moving[-1]) + 2 if moving.size else 1

    @property
    def astray(self) -> tuple[int, int] | None:
        """Numbers of places up to the end of the belts, and until the bottle had left them by ASTRAY; None on belts."""
        return self._astray

    def closed(self) -> int | None:
        """Return the number of places up to an earlier place with the same direction, or None. Call once per chunk."""
        steps = np.diff(np.vstack([self._chunks[-2][-1:], self.chunk]), axis=0)
        for place, step in enumerate(steps):
            way = self._way + float(np.hypot(*step))
            if math.floor(way / self._radius) > math.floor(self._way / self._radius):
                if self._was_here(way, self.chunk[place], step):
                    return self.before + place + 1
                self._marks.setdefault(self._cell(self.chunk[place]), []).append((way, self.chunk[place], step))
            self._way = way
        return None

    def _was_here(self, way: float, point: Array, step: Array) -> bool:
        column, row = self._cell(point)
        return any(
            way - before > LOOP * self._radius
            and math.dist(point, earlier) < SAME * self._radius
            and float(step @ direction) > 0.0
            for right in (-1, 0, 1)
            for up in (-1, 0, 1)
            for before, earlier, direction in self._marks.get((column + right, row + up), ())
        )

    def _cell(self, point: Array) -> tuple[int, int]:
        return math.floor(point[0] / self._radius), math.floor(point[1] / self._radius)

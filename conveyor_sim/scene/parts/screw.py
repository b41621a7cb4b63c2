# SPDX-License-Identifier: Apache-2.0
"""Infeed screws of a scene file: they space bottles to a pitch that grows along the screw."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, ClassVar

from pydantic import AfterValidator

from conveyor_sim.scene.layout.plan import Side
from conveyor_sim.scene.parts.device_part import DevicePart, Others, line_problems, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import TOUCH, Angle, Component, Holds, Name, Point, Positive, Says, Span, quantity
from conveyor_sim.scene.words import shown

_MOST = 100


def _bounded(value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if not 1 <= len(value) <= _MOST:
        raise ValueError("out of bounds")
    return value


PitchPoint = Annotated[tuple[Component, Component], Says("a distance and a pitch [distance, pitch]")]
PitchTable = Annotated[
    tuple[PitchPoint, ...], AfterValidator(_bounded), Holds(f"a list of 1 to {_MOST} points [distance, pitch]")
]


class Screw(DevicePart):
    """An infeed screw beside the path of bottles, from `from` to `to` along a straight line.

    Each turn takes one bottle. Between two points of the table, bottles are uniformly accelerated. The thread rises
    over the first pitch and falls over one pitch beyond `to`.
    """

    KIND: ClassVar[str] = "screw"

    material: Name = quantity("Material, as named in `contacts`.")
    axis: Name = quantity("Axis that turns it, as named in `axes`. One turn of the axis is one turn of the screw.")
    from_: Point = quantity("Axis of a bottle where the screw begins.", "m", alias="from")
    to: Point = quantity("Axis of a bottle where it hands bottles over.", "m")
    side: Side = quantity("Side of the bottles on which the screw is, seen along travel.")
    pitch: PitchTable = quantity(
        "Distances from `from` and the pitch there: travel of a bottle per turn. The first distance is 0. The last "
        "pitch holds up to `to`.",
        "m",
    )
    pocket_radius: Positive = quantity("Radius of the thread's profile: that of a bottle, and its play.", "m")
    opening: Span = quantity(
        "Angle of the profile's arc, symmetrical about the direction to the screw. It is the depth of the thread.",
        "rad",
        default=math.radians(120.0),
    )
    phase: Angle = quantity("Position of the axis at which a bottle is at `to`.", "rad", default=0.0)

    @property
    def length(self) -> float:
        """Distance from `from` to `to`, m."""
        return math.dist(self.from_, self.to)

    @property
    def last_pitch(self) -> float:
        """Pitch at `to`, m."""
        return self.pitch[-1][1]

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of the line, of the table of pitches, and of unknown names."""
        yield from name_problems((*path, "axis"), self.axis, "axes", others)
        yield from line_problems(path, self.from_, self.to)
        if self.opening > math.pi:
            yield Problem(
                (*path, "opening"), f"{shown(self.opening)} given, expected at most half a turn, {math.pi:.6g} (rad)"
            )
        first = self.pitch[0][0]
        if first != 0.0:
            yield Problem((*path, "pitch", 0), f"{shown(first)} given, expected 0, the distance of the first point (m)")
        for index, ((before, _), (after, _)) in enumerate(pairwise(self.pitch), 1):
            if after - before <= TOUCH:
                text = f"{shown(after)} given, expected a distance beyond that of the point before, {before:.6g} (m)"
                yield Problem((*path, "pitch", index), text)
        if self.pitch[-1][0] > self.length + TOUCH:
            text = f"{shown(self.pitch[-1][0])} given, expected at most {self.length:.6g}, the length of the screw (m)"
            yield Problem((*path, "pitch", len(self.pitch) - 1), text)
        yield from self._pocket_problems(path)

    def _pocket_problems(self, path: Path) -> Iterator[Problem]:
        width = 2.0 * self.pocket_radius * math.sin(0.5 * min(self.opening, math.pi))
        for index, (_, pitch) in enumerate(self.pitch):
            if pitch < width - TOUCH:
                text = f"{shown(pitch)} given, expected at least the width of the thread's profile, {width:.6g} (m)"
                yield Problem((*path, "pitch", index), text)
                return

# SPDX-License-Identifier: Apache-2.0
"""Star wheels of a scene file: wheels with pockets that carry bottles along an arc."""

import math
from collections.abc import Iterator
from typing import ClassVar, Literal

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import DevicePart, Others, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Count, Name, NotNegative, Point, Positive, Span, quantity
from conveyor_sim.scene.words import shown

WIDEST_POCKET = math.pi
"""Largest opening of a pocket, rad: beyond half a turn, a bottle could not leave it."""


class StarGuide(Part):
    """Guide around a star wheel, an arc that holds bottles in the pockets. It becomes the rail `<star>_guide`."""

    material: Name = quantity("Material, as named in `contacts`.")
    clearance: NotNegative = quantity(
        "Distance between the guide and the circles of the pockets. Together with the play of a bottle in its pocket "
        "it lets bottles move outward.",
        "m",
        default=0.0,
    )
    from_: Angle = quantity("Angle after `entry` at which it begins.", "rad", default=0.0, alias="from")
    to: Span | None = quantity("Angle after `entry` at which it ends. Left out: `carry`.", "rad", default=None)


class Star(DevicePart):
    """A star wheel: it takes bottles at `entry`, carries them in its pockets, and hands them over after `carry`.

    Placed by `centre`, `turn` and `entry`, or by `after`, tangent to another wheel where that one hands bottles over.
    """

    KIND: ClassVar[str] = "star"

    material: Name = quantity("Material, as named in `contacts`.")
    axis: Name = quantity("Axis that turns it, as named in `axes`. One turn of the axis is one turn of the wheel.")
    pockets: Count = quantity("Number of pockets.", "1")
    pitch_radius: Positive = quantity("Radius of the circle on which the axes of carried bottles lie.", "m")
    pocket_radius: Positive = quantity("Radius of a pocket: that of a bottle, and its play.", "m")
    opening: Span = quantity(
        "Angle of a pocket's arc, symmetrical about the direction to the centre of the wheel. At half a turn the "
        "pocket encloses half of a bottle.",
        "rad",
        default=math.radians(150.0),
    )
    carry: Span = quantity("Angle through which it carries bottles.", "rad", default=math.pi)
    centre: Point | None = quantity("Centre of the wheel.", "m", default=None)
    turn: Literal["left", "right"] | None = quantity(
        "Side to which bottles turn: `left` is counter-clockwise. Left out after another wheel: opposite to that one.",
        default=None,
    )
    entry: Angle | None = quantity(
        "Direction from the centre to the point where bottles enter, counter-clockwise from the x-axis.",
        "rad",
        default=None,
    )
    after: Name | None = quantity("Wheel that hands bottles over to this one, instead of coordinates.", default=None)
    phase: Angle | None = quantity(
        "Position of the axis at which the first pocket is at the entry. Left out: as the wheel in `after` or the "
        "screw that feeds it needs it; 0 if nothing on the same master feeds it.",
        "rad",
        default=None,
    )
    worn: NotNegative = quantity("Increase of the radius of the first pocket by wear.", "m", default=0.0)
    guide: StarGuide | None = quantity("Guide around it. Left out: none.", default=None)

    @property
    def pitch(self) -> float:
        """Distance between pockets along the pitch circle, m."""
        return 2.0 * math.pi * self.pitch_radius / self.pockets

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of its place, of pockets that overlap, and of unknown names."""
        yield from name_problems((*path, "axis"), self.axis, "axes", others)
        yield from name_problems((*path, "after"), self.after, "stars", others)
        yield from self._place_problems(path, others)
        if self.opening > WIDEST_POCKET:
            text = f"{shown(self.opening)} given, expected at most half a turn, {math.pi:.6g} (rad)"
            yield Problem((*path, "opening"), text)
        elif not self.land > 0.0:
            text = f"{shown(self.pockets)} given, expected pockets that do not overlap: at most {self._most_pockets}"
            yield Problem((*path, "pockets"), text)
        elif not self._worn_land > 0.0:
            text = f"{shown(self.worn)} given, expected a first pocket that does not reach into the next one"
            yield Problem((*path, "worn"), f"{text} (m)")

    @property
    def tip_radius(self) -> float:
        """Distance of the tips of the pockets from the centre of the wheel, m."""
        half = 0.5 * self.opening
        return math.hypot(self.pitch_radius - self.pocket_radius * math.cos(half), self.pocket_radius * math.sin(half))

    def tip_angle(self, radius: float) -> float:
        """Return the angle (rad) at the wheel's centre from the middle of a pocket of a radius (m) to its tips."""
        half = 0.5 * self.opening
        return math.atan2(radius * math.sin(half), self.pitch_radius - radius * math.cos(half))

    @property
    def land(self) -> float:
        """Angle of the rim between two pockets, rad; negative if pockets overlap."""
        return 2.0 * math.pi / self.pockets - 2.0 * self.tip_angle(self.pocket_radius)

    @property
    def _worn_land(self) -> float:
        """Angle of the rim between the worn pocket and the next one, rad; negative if they overlap."""
        worn = self.tip_angle(self.pocket_radius + self.worn)
        return 2.0 * math.pi / self.pockets - worn - (worn if self.pockets == 1 else self.tip_angle(self.pocket_radius))

    @property
    def _most_pockets(self) -> int:
        return max(1, math.ceil(math.pi / self.tip_angle(self.pocket_radius)) - 1)

    def _place_problems(self, path: Path, others: Others) -> Iterator[Problem]:
        names = [name for name in ("centre", "turn", "entry") if getattr(self, name) is not None]
        if self.after is None and len(names) < 3:
            text = f"{' and '.join(names) or 'no place'} given, expected centre, turn and entry, or after"
            yield Problem(path, text)
        elif self.after is not None and names:
            yield Problem((*path, names[0]), "given with after, expected one of them")
        elif self.after is not None and _returns(path[-1], self.after, others["stars"]):
            text = f"{shown(self.after)} given, expected a wheel that is not placed after this one"
            yield Problem((*path, "after"), text)


def _returns(name: object, after: str | None, stars: object) -> bool:
    """Return True if the chain of wheels that begins with `after` leads to a wheel again."""
    seen = {name}
    while after is not None and isinstance(stars, dict) and after in stars:
        if after in seen:
            return True
        seen.add(after)
        after = stars[after].after
    return False

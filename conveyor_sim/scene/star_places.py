# SPDX-License-Identifier: Apache-2.0
"""Places of star wheels, also of wheels that follow each other, and guides around them. Pure functions; m and rad.

A wheel's coordinate is the angle that it has turned in its own direction. At coordinate 0 the middle of pocket 0 is at
the entry, where bottles come in. Pocket k follows k pitches behind.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from conveyor_sim.scene.angles import unit_vector
from conveyor_sim.scene.parts.star import Star
from conveyor_sim.scene.rails import ArcRail
from conveyor_sim.scene.types import COORDINATE_LIMIT, XY


@dataclass(frozen=True)
class Wheel:
    """A star wheel in its place."""

    name: str
    part: Star
    centre: XY
    sign: float
    """1 turns counter-clockwise, so that bottles turn left; -1 clockwise."""
    entry: float
    """Direction from the centre to the entry."""

    @property
    def leaving(self) -> float:
        """Direction from the centre to the point where bottles are handed over."""
        return self.entry + self.sign * self.part.carry

    def point(self, angle: float) -> XY:
        """Return the point of the pitch circle at an angle after the entry, in the direction of rotation."""
        cos, sin = unit_vector(self.entry + self.sign * angle)
        return self.centre[0] + self.part.pitch_radius * cos, self.centre[1] + self.part.pitch_radius * sin

    def heading(self, angle: float) -> float:
        """Return the direction of travel of bottles at an angle after the entry."""
        return self.entry + self.sign * (angle + 0.5 * math.pi)

    def pocket(self, index: int, coordinate: float = 0.0) -> XY:
        """Return the centre of a pocket."""
        return self.point(coordinate - index * 2.0 * math.pi / self.part.pockets)


def wheels_of(stars: Mapping[str, Star]) -> dict[str, Wheel]:
    """Return the wheels by name, without those whose place is unknown or too far away, and those that follow them."""
    wheels: dict[str, Wheel] = {}
    waiting = dict(stars)
    while waiting:
        placed = {name: wheel for name, star in waiting.items() if (wheel := _placed(name, star, wheels)) is not None}
        if not placed:
            break
        wheels |= placed
        waiting = {name: star for name, star in waiting.items() if name not in wheels}
    return {name: wheels[name] for name in stars if name in wheels}


def _placed(name: str, star: Star, wheels: Mapping[str, Wheel]) -> Wheel | None:
    """Return a wheel whose place follows from its fields or from a wheel that is placed; None if it doesn't."""
    if star.after is None:
        if star.centre is None or star.turn is None or star.entry is None:
            return None
        return Wheel(name, star, star.centre, 1.0 if star.turn == "left" else -1.0, star.entry)
    before = wheels.get(star.after)
    if before is None:
        return None
    cos, sin = unit_vector(before.leaving)
    apart = before.part.pitch_radius + star.pitch_radius
    centre = before.centre[0] + apart * cos, before.centre[1] + apart * sin
    if max(map(abs, centre)) > COORDINATE_LIMIT:
        return None
    return Wheel(name, star, centre, -before.sign, before.leaving + math.pi)


def guide_rails(stars: Mapping[str, Star]) -> dict[str, ArcRail]:
    """Return the guides around wheels by the names of their rails, `<star>_guide`."""
    wheels = wheels_of(stars).items()
    return {f"{name}_guide": rail for name, wheel in wheels if (rail := _guide(wheel)) is not None}


def _guide(wheel: Wheel) -> ArcRail | None:
    """Return the guide around a wheel; None without one, or if it has no length."""
    guide = wheel.part.guide
    if guide is None:
        return None
    to = wheel.part.carry if guide.to is None else guide.to
    span = min(to - guide.from_, 2.0 * math.pi)
    if span <= 0.0:
        return None
    return ArcRail(
        kind="arc",
        material=guide.material,
        centre=wheel.centre,
        radius=wheel.part.pitch_radius + wheel.part.pocket_radius + guide.clearance,
        start_angle=math.fmod(wheel.entry + (guide.from_ if wheel.sign > 0.0 else -to), 2.0 * math.pi),
        span=span,
    )

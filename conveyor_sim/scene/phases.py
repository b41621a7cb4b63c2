# SPDX-License-Identifier: Apache-2.0
"""Phases of machines in step: positions of axes at which bottles reach star wheels. Pure functions; m and rad."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from conveyor_sim.scene.parts.axis import Axis
from conveyor_sim.scene.parts.screw import Screw
from conveyor_sim.scene.parts.star import Star
from conveyor_sim.scene.star_places import Wheel, wheels_of
from conveyor_sim.scene.types import XY

TURN = 2.0 * math.pi

ASIDE = 0.02
"""Largest distance of the end of a screw from the line on which a wheel takes bottles, m."""

APART = 5.0
"""Largest distance of a wheel from the screw that feeds it, m."""


@dataclass(frozen=True)
class Gear:
    """Position of an axis over that of the first master: position = ratio x master + phase."""

    root: str
    ratio: float
    phase: float

    def master(self, position: float) -> float:
        """Return the position of the first master at a position of the axis, rad."""
        return (position - self.phase) / self.ratio

    def position(self, master: float) -> float:
        """Return the position of the axis at a position of the first master, rad."""
        return self.ratio * master + self.phase


def gear_of(axes: Mapping[str, Axis], name: str) -> Gear | None:
    """Return the gear of an axis; None for unknown names and circles. An axis with a cam is a first master."""
    ratio, phase, seen = 1.0, 0.0, set()
    while name in axes and name not in seen:
        axis = axes[name]
        if axis.master is None or axis.cam is not None or axis.ratio == 0.0:
            return Gear(name, ratio, phase)
        ratio, phase = ratio * axis.ratio, phase + ratio * axis.phase
        seen.add(name)
        name = axis.master
    return None


@dataclass(frozen=True)
class Supply:
    """Bottles that come to a wheel from a screw or from another wheel."""

    field: str
    name: str
    axis: str
    position: float
    """Position of this axis at which a bottle reaches the wheel, rad."""
    per_turn: int
    """Bottles per turn of this axis."""
    pitch: float
    """Distance between bottles, m."""


def supply_of(
    wheel: Wheel, stars: Mapping[str, Star], screws: Mapping[str, Screw], phases: Mapping[str, float]
) -> Supply | None:
    """Return the supply of a wheel; None if nothing in the scene feeds it in step.

    phases: positions at which pockets of the wheels before are at their entries, rad.
    """
    before = wheel.part.after
    if before is not None:
        if before not in phases:
            return None
        star = stars[before]
        return Supply("stars", before, star.axis, phases[before] + star.carry, star.pockets, star.pitch)
    feeding = [(apart, name) for name, screw in screws.items() if (apart := _apart(screw, wheel)) is not None]
    if not feeding:
        return None
    apart, name = min(feeding)
    screw = screws[name]
    return Supply("screws", name, screw.axis, screw.phase + TURN * apart / screw.last_pitch, 1, screw.last_pitch)


def _apart(screw: Screw, wheel: Wheel) -> float | None:
    """Return the distance (m) of a wheel's entry from the end of a screw that leads to it; None for other screws."""
    length = screw.length
    if length == 0.0:
        return None
    along = (screw.to[0] - screw.from_[0]) / length, (screw.to[1] - screw.from_[1]) / length
    heading, entry = wheel.heading(0.0), wheel.point(0.0)
    if along[0] * math.cos(heading) + along[1] * math.sin(heading) < math.cos(math.radians(1.0)):
        return None
    apart, aside = _seen(entry, screw.to, along)
    return apart if abs(aside) <= ASIDE and -ASIDE <= apart <= APART else None


def _seen(point: XY, origin: XY, along: XY) -> XY:
    dx, dy = point[0] - origin[0], point[1] - origin[1]
    return dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]


@dataclass(frozen=True)
class StarPhase:
    """Phase of a star wheel."""

    wheel: Wheel
    phase: float
    """Position of its axis at which the first pocket is at the entry, rad."""
    supply: Supply | None
    fitting: float | None
    """Phase at which its pockets meet the bottles of the supply, rad; None if it follows from nothing."""

    @property
    def error(self) -> float:
        """Distance of a pocket from the bottle that it should meet, m; positive if the pocket comes too early."""
        if self.fitting is None:
            return 0.0
        spacing = TURN / self.wheel.part.pockets
        angle = self.fitting - self.phase
        return (angle - spacing * round(angle / spacing)) * self.wheel.part.pitch_radius


def star_phases(
    stars: Mapping[str, Star], screws: Mapping[str, Screw], axes: Mapping[str, Axis]
) -> dict[str, StarPhase]:
    """Return the phases of all wheels that have a place, by name."""
    phases: dict[str, float] = {}
    result: dict[str, StarPhase] = {}
    wheels = wheels_of(stars)
    for name in _in_order(wheels):
        wheel = wheels[name]
        supply = supply_of(wheel, stars, screws, phases)
        fitting = None if supply is None else fitting_phase(wheel.part, supply, axes)
        given = wheel.part.phase
        phases[name] = (fitting or 0.0) if given is None else given
        result[name] = StarPhase(wheel, phases[name], supply, fitting)
    return {name: result[name] for name in stars if name in result}


def _in_order(wheels: Mapping[str, Wheel]) -> Iterator[str]:
    """Yield the names of wheels, each behind that of the wheel before it."""
    done: set[str] = set()
    while len(done) < len(wheels):
        for name, wheel in wheels.items():
            if name not in done and (wheel.part.after is None or wheel.part.after in done):
                done.add(name)
                yield name


def fitting_phase(star: Star, supply: Supply, axes: Mapping[str, Axis]) -> float | None:
    """Return the least phase (rad) of a wheel at which its pockets meet bottles; None without a common master."""
    own, other = gear_of(axes, star.axis), gear_of(axes, supply.axis)
    if own is None or other is None or own.root != other.root:
        return None
    position = own.position(other.master(supply.position))
    spacing = TURN / star.pockets
    return position - spacing * math.floor(position / spacing)


def rates(star: Star, supply: Supply, axes: Mapping[str, Axis]) -> tuple[float, float] | None:
    """Return pockets of a wheel, and bottles of its supply, per turn of their common master; None without one."""
    own, other = gear_of(axes, star.axis), gear_of(axes, supply.axis)
    if own is None or other is None or own.root != other.root:
        return None
    return star.pockets * own.ratio, supply.per_turn * other.ratio

# SPDX-License-Identifier: Apache-2.0
"""Belts slower than the slip limit: share of mu m g with which they drag a bottle that is held at rest.

Such a bottle slips with the speed of its belt. The regularised curve of friction, (7)-(10), gives the full mu m g only
at slips from v_lim on.
"""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from conveyor_sim.physics.laws.coefficients import base_friction, base_springs
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.driven import belt_speeds, speed_limits, speed_owner
from conveyor_sim.scene.geometry import BeltShape
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import BottleType, Scene


@dataclass(frozen=True)
class SlowBelt:
    """Belt with a speed below the slip limit."""

    path: Path
    """Field of the scene with this speed."""
    belt: str
    place: str
    """Place or time of this speed, in words; empty for the nominal speed."""
    speed: float
    """m/s, greater than 0."""
    share: float
    """Force on a bottle held at rest over mu m g."""
    curves: frozenset[str]
    """Friction curves of the bottle types, for `drag_share`."""


def drag_share(speed: float, slip_limit: float, curve: str) -> float:
    """Return the friction over mu m g at a slip speed (m/s).

    curve: "polynomial" or "atan", of bases that are points; "ring", of a ring that does not spin.
    """
    t = speed / slip_limit
    if curve == "ring":
        return t / math.hypot(t, 0.5)
    if curve == "atan":
        return 2.0 / math.pi * math.atan(math.pi * t)
    return min(t, 1.0) * (2.0 - min(t, 1.0))


def slow_belts(plant: Plant, on: Collection[str]) -> list[SlowBelt]:
    """Return the belts that are slower than the slip limit, each at its smallest share, in listing order.

    Belts at rest and bottles held by springs (`static_friction`) are left out. on: enabled effects.
    """
    if "base_friction" not in on:
        return []
    limit, slowest = plant.scene.slip_limit, dict[str, SlowBelt]()
    for row, shape in enumerate(plant.surfaces):
        curves = frozenset() if shape.belt is None else _curves(plant, row, on)
        if not curves:
            continue
        for path, place, speed in _speeds(plant, shape):
            if 0.0 < speed < limit:
                share = min(drag_share(speed, limit, curve) for curve in curves)
                known = slowest.get(shape.belt_name)
                if known is None or speed < known.speed:
                    slowest[shape.belt_name] = SlowBelt(path, shape.belt_name, place, speed, share, curves)
    return list(slowest.values())


def _curves(plant: Plant, row: int, on: Collection[str]) -> frozenset[str]:
    """Return the friction curves of the bottle types of a run on the surface `row`."""
    scene, curves = plant.scene, set()
    friction = base_friction(scene)[row]
    springs = base_springs(scene) if "static_friction" in on else None
    for column, (name, kind) in enumerate(scene.bottle_types.items()):
        if name not in plant.supply or not friction[column]:
            continue
        ring = kind.base_radius is not None and "ring_base" in on
        if ring or springs is None or not springs.stiffness[row, column]:
            curves.add("ring" if ring else scene.friction_curve)
    return frozenset(curves)


def _speeds(plant: Plant, shape: BeltShape) -> Iterator[tuple[Path, str, float]]:
    """Yield nominal speed and least speed of a moved surface (m/s): field of the scene, place in words, speed."""
    scene, name = plant.scene, shape.belt_name
    path = speed_owner(scene, name)
    share, inside = shape.ratio, ""
    if shape.kind == "curved":
        # The axis of a bottle within its radius of the centre of a disc turns in place.
        share *= max(shape.inner_radius, _smallest(scene).radius) / shape.centre_radius
        inside = " at its inner radius" if share < shape.ratio else ""
    yield (*path, "rate" if path[0] == "axes" else "speed"), inside, share * abs(belt_speeds(scene)[name])
    least, greatest = speed_limits(scene, name)
    if least * greatest > 0.0:
        yield (
            (*path, "speed_limits"),
            f"{inside} at the least speed of its limits",
            share * min(abs(least), abs(greatest)),
        )


def _smallest(scene: Scene) -> BottleType:
    return min(scene.bottle_types.values(), key=lambda kind: kind.radius)

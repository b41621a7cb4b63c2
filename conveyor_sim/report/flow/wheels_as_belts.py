# SPDX-License-Identifier: Apache-2.0
"""Star wheels in traces: a lone bottle passes a wheel as on a curved belt between two rails."""

from __future__ import annotations

import math

from conveyor_sim.scene.belts import BeltRails, CurvedBelt
from conveyor_sim.scene.gearing import first_speed, rated_speed
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.star_places import wheels_of


def with_wheels_as_belts(scene: Scene) -> Scene:
    """Return a scene whose star wheels are curved belts with rails; the scene itself if it has no wheels or belts.

    Wheels that stand at the start turn at their largest speed in gear, as a controller will run them.
    """
    wheels = wheels_of(scene.stars)
    if not wheels or not scene.belts:
        return scene
    material = next(iter(scene.belts.values())).material
    belts = {}
    for name, wheel in wheels.items():
        part = wheel.part
        start = wheel.entry if wheel.sign > 0.0 else wheel.leaving
        belts[belt_name(name)] = CurvedBelt.model_construct(
            kind="curved",
            material=material,
            centre=wheel.centre,
            inner_radius=part.pitch_radius - part.pocket_radius,
            width=2.0 * part.pocket_radius,
            start_angle=start,
            span=min(part.carry, 2.0 * math.pi),
            turn="left" if wheel.sign > 0.0 else "right",
            speed=(first_speed(scene, part.axis) or rated_speed(scene, part.axis)) * part.pitch_radius,
            rails=BeltRails.model_construct(inner=True, outer=True, material=part.material),
        )
    return scene.model_copy(update={"belts": {**scene.belts, **belts}, "stars": {}})


def pitches_of(scene: Scene) -> dict[str, float]:
    """Return the distance (m) of pockets on the pitch circle of each star wheel, by the name of its belt in traces."""
    return {belt_name(name): 2.0 * math.pi * star.pitch_radius / star.pockets for name, star in scene.stars.items()}


def belt_name(star: str) -> str:
    """Return the name of the belt that replaces a star wheel."""
    return f"{star} (star)"

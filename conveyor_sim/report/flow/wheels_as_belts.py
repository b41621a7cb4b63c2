# SPDX-License-Identifier: Apache-2.0
"""Star wheels in traces: a lone bottle passes a wheel as on a curved belt between two rails."""

from __future__ import annotations

import math

from conveyor_sim.scene.belts import BeltRails, CurvedBelt
from conveyor_sim.scene.gearing import first_speed
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.star_places import wheels_of


def with_wheels_as_belts(scene: Scene) -> Scene:
    """Return a scene whose star wheels are curved belts with rails; the scene itself if it has no wheels or belts."""
    wheels = wheels_of(scene.stars)
    if not wheels or not scene.belts:
        return scene
    material = next(iter(scene.belts.values())).material
    belts = {}
    for name, wheel in wheels.items():
        part = wheel.part
        start = wheel.entry if wheel.sign > 0.0 else wheel.leaving
        belts[f"{name} (star)"] = CurvedBelt.model_construct(
            kind="curved",
            material=material,
            centre=wheel.centre,
            inner_radius=part.pitch_radius - part.pocket_radius,
            width=2.0 * part.pocket_radius,
            start_angle=start,
            span=min(part.carry, 2.0 * math.pi),
            turn="left" if wheel.sign > 0.0 else "right",
            speed=first_speed(scene, part.axis) * part.pitch_radius,
            rails=BeltRails.model_construct(inner=True, outer=True, material=part.material),
        )
    return scene.model_copy(update={"belts": {**scene.belts, **belts}, "stars": {}})

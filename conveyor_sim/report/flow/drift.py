"""Estimate of a bottle's way by the speeds of the belts, where a trace would take too long."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from conveyor_sim.report.flow.guides import Guides, left_of
from conveyor_sim.report.flow.surfaces import NONE, SurfaceMap
from conveyor_sim.scene.geometry import Array
from conveyor_sim.scene.polygons import inside
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import XY

STEP = 0.05
"""m"""

MOST_STEPS = 4000
"""Steps of all estimates of a scene, 200 m."""

LANE = 1.0
"""m, farthest guide that leads a bottle."""


def drift(
    start: Array,
    along: Array,
    surfaces: SurfaceMap,
    guides: Guides,
    takers: Sequence[tuple[Path, Sequence[XY]]],
    steps: int,
) -> tuple[Array, Array, Path | None]:
    """Return times (k,) s and places (k, 2) of a bottle that moves with the belts, and the device that takes it.

    start: place, m. along: unit vector of its motion. takers: devices with their regions. It follows the middle between
    guides, and ends after a number of steps or beside the belts, without a device (None).
    """
    place, time, speed = start.copy(), 0.0, 0.0
    times, places = [], []
    for _ in range(steps):
        carrier = int(surfaces.under(place[None])[0])
        if carrier != NONE and not surfaces[carrier].rests:
            along, speed = surfaces[carrier].heading(place[None])[0], abs(surfaces[carrier].running)
        if carrier == NONE or speed == 0.0:
            break
        left = left_of(along[None])
        to_left, to_right = float(guides.distance(place[None], left)[0]), float(guides.distance(place[None], -left)[0])
        aside = 0.5 * (to_left - to_right) if max(to_left, to_right) < LANE else 0.0
        place = place + STEP * along + aside * left[0]
        time += STEP / speed
        times.append(time)
        places.append(place)
        for path, region in takers:
            if inside(place[None], region)[0]:
                return np.array(times), np.array(places), path
    return np.array(times), np.array(places).reshape(-1, 2), None

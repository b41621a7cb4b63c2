# SPDX-License-Identifier: Apache-2.0
"""Seeds: many runs of one scene that differ as one day of a line differs from the next, by a little at its start."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.scene import Scene, rail_shapes
from conveyor_sim.scene.overlaps import near_pieces, overlapping
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.types import TOUCH
from conveyor_sim.simulation import Simulation

PLACE = 0.01
"""Position jitter as a fraction of the radius. Guides of an infeed leave about a millimetre."""

TIMING = 0.01
"""Timing jitter as a fraction of the time between two bottles."""

ROOM = 1.0 / 3.0
"""Usable fraction of the clear gap beside a bottle: two approaching bottles leave a third of it."""

NUDGE = 0.1
"""Speed of a bottle without clearance, as a fraction of the slip limit v_lim; static friction holds it nearly still."""


def jittered(scene: Scene, seed: int) -> dict[str, Any]:
    """Fields to lay over a scene for a run of a seed: the seed, and jitter of infeeds that have none of their own.

    Sideways by up to PLACE of the radius, less beside rails; with a rate, early or late by TIMING, too: evenly to both
    sides, so that the mean flow stays. (In a packed queue jitter can only delay, so there is none along it.)
    """
    infeeds = {
        name: _jitter(scene, infeed)
        for name, infeed in scene.infeeds.items()
        if infeed.timing_jitter == 0.0 and infeed.lateral_jitter == 0.0
    }
    return {"seed": seed, "infeeds": infeeds} if infeeds else {"seed": seed}


def disturb(simulation: Simulation, seed: int) -> None:
    """Displace every bottle, evenly in a disc of PLACE of its radius, less where another one or a rail is near.

    No overlap comes of it. Bottles that touch something stay and get a velocity instead, evenly in a disc of NUDGE.
    """
    bottles = simulation.bottles()
    if not len(bottles.id):
        return
    radius = simulation.model.type_radius[bottles.type]
    reach = np.minimum(PLACE * radius, ROOM * _clear_gaps(simulation.scene, bottles.x, bottles.y, radius))
    tight = reach < TOUCH
    # A second word beside the seed, because the infeeds draw from the seed alone.
    random = np.random.Generator(np.random.PCG64([seed, 1]))
    angle = random.uniform(0.0, 2.0 * math.pi, len(radius))
    share = np.sqrt(random.uniform(0.0, 1.0, len(radius)))
    x, y = share * np.cos(angle), share * np.sin(angle)
    move, speed = np.where(tight, 0.0, reach), np.where(tight, NUDGE * simulation.scene.slip_limit, 0.0)
    displace(simulation, move * x, move * y, speed * x, speed * y)


def _jitter(scene: Scene, infeed: Infeed) -> dict[str, float]:
    radius = scene.bottle_types[infeed.bottle].radius
    position = np.array([infeed.position])
    apart = [float(piece.distance(position)[0]) for rail in rail_shapes(scene) for piece in rail.pieces]
    sideways = min(PLACE * radius, ROOM * (min(apart, default=math.inf) - radius))
    fields = {"lateral_jitter": sideways} if sideways > TOUCH else {}
    return fields if infeed.rate is None else {**fields, "timing_jitter": TIMING / infeed.rate}


def _clear_gaps(
    scene: Scene, x: NDArray[np.float64], y: NDArray[np.float64], radius: NDArray[np.float64]
) -> NDArray[np.float64]:
    """From each bottle to the nearest other one or rail, m; inf where it is too far to matter."""
    points, matters = np.column_stack([x, y]), PLACE / ROOM * float(radius.max())
    gaps = np.full(len(x), math.inf)
    i, j = overlapping(points, radius + 0.5 * matters, 0.0)
    between = np.hypot(x[i] - x[j], y[i] - y[j]) - radius[i] - radius[j]
    np.minimum.at(gaps, i, between)
    np.minimum.at(gaps, j, between)
    pieces = [piece for rail in rail_shapes(scene) for piece in rail.pieces]
    for _, near, apart in near_pieces(points, pieces, float(radius.max()) + matters):
        gaps[near] = np.minimum(gaps[near], apart - radius[near])
    return gaps

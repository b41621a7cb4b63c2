# SPDX-License-Identifier: Apache-2.0
"""Findings about exits: bottles that reach none, and perfect columns where they queue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.report.flow.clearance import Clearance
from conveyor_sim.report.flow.finding import Finding, at
from conveyor_sim.report.flow.routes import TransitRoute
from conveyor_sim.report.flow.stretches import feed_rate
from conveyor_sim.report.flow.surfaces import NONE, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.schema import Scene

STRAIGHT = 1e-9
"""m, sideways motion below which a path is exactly straight: rounding of the engine."""


def has_exit(scene: Scene) -> bool:
    """Return True if bottles can leave a scene for good."""
    return any(isinstance(part, (Outfeed, Sink)) for _, part in scene.exits())


def unreached_exits(scene: Scene, surfaces: SurfaceMap, routes: Sequence[TransitRoute]) -> Iterator[Finding]:
    """Yield a finding for each entry from which a bottle reaches no exit, if the scene has one."""
    for route in routes if has_exit(scene) else ():
        if route.last.end not in ("exit", "cap"):
            text = f"no exit is reached: a lone bottle {ending(route.last, surfaces)}, after {route.length:.2f} m"
            yield Finding(route.entry, text)


def ending(leg: Leg, surfaces: SurfaceMap) -> str:
    """Return the end of a leg without an exit, in words."""
    belt = "" if leg.last_carrier == NONE else f" {surfaces[leg.last_carrier].name}"
    place = at(leg.last)
    return {
        "stopped": f"stops on{belt} at {place}",
        "off": f"leaves{belt or ' the line'} at {place}",
        "circulates": f"circulates, back at {place} on{belt}",
        "station": f"ends in a loop of stations at {place}",
        "failed": f"can't be traced from {place} ({leg.reason})",
        "cap": f"is on its way on{belt} at {place} where the trace ends",
        "exit": f"leaves at {place}",
    }[leg.end]


def perfect_columns(
    scene: Scene, surfaces: SurfaceMap, legs: Sequence[Leg], clearances: Sequence[Clearance | None]
) -> Iterator[Finding]:
    """Yield a finding for each entry without scatter whose bottles queue in one exact line in a wide place."""
    for leg, samples in zip(legs, clearances, strict=True):
        if samples is None or leg.start.path[0] == "bottles" or _scatters(scene, leg):
            continue
        others = [other for other in legs if other is not leg]
        for carrier in dict.fromkeys(samples.carriers[samples.wide].tolist()):
            if carrier == NONE or not _straight(leg, carrier) or not _queues(scene, leg, surfaces, carrier):
                continue
            if any((other.carriers == carrier).any() for other in others):
                continue
            text = (
                f"no scatter: bottles meet in one exact column on {surfaces[carrier].name}, with room for several; "
                "expected lateral_jitter, such as 0.5 mm, or 0 on purpose"
            )
            yield Finding(leg.start.path, text)
            break


def _scatters(scene: Scene, leg: Leg) -> bool:
    part = scene.named()[str(leg.start.path[0])][str(leg.start.path[1])]
    if isinstance(part, Source) and part.layer is not None:
        return True  # a layer is as wide as the pallet
    # A scatter of 0 that is written is meant.
    return isinstance(part, Scattered) and not {"lateral_jitter", "angular_jitter"}.isdisjoint(part.model_fields_set)


def _straight(leg: Leg, carrier: int) -> bool:
    """Return True if a path is exactly straight on a belt, to its end there."""
    points = leg.points[leg.carriers == carrier]
    along = points[-1] - points[0]
    length = float(np.hypot(*along))
    if length < leg.radius:
        return False
    across = (points - points[0]) @ np.array([-along[1], along[0]]) / length
    return float(np.abs(across).max()) <= STRAIGHT


def _queues(scene: Scene, leg: Leg, surfaces: SurfaceMap, carrier: int) -> bool:
    """Return True if bottles of a leg meet on a belt: it is too slow for them, or they wait at its end."""
    rate = feed_rate(scene, leg.start.path)
    if rate > abs(surfaces[carrier].running) / (2.0 * leg.radius) > 0.0:
        return True
    if leg.last_carrier != carrier:
        return False
    taker = scene.machines.get(str(leg.exit[1])) if leg.exit is not None and leg.exit[0] == "machines" else None
    return leg.end == "stopped" or (isinstance(taker, TakingPart) and rate > taker.rate)

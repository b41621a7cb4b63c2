# SPDX-License-Identifier: Apache-2.0
"""Findings about belts: belts against their neighbours, belts that run backwards, watchdogs, transfer gaps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from conveyor_sim.report.flow.finding import Finding, at, in_mm
from conveyor_sim.report.flow.surfaces import NONE, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.driven import speed_owner
from conveyor_sim.scene.geometry import Array
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import some_of

NEXT_TO = (0.005, 0.02, 0.05, 0.1)
"""m beyond the end of a belt at which the next one is looked for."""

OPPOSED = -0.5
"""Largest cosine between two directions of travel that oppose each other."""

GAP_AHEAD = 0.5
"""m beyond a belt at which the far side of a transfer gap is looked for."""


def opposed_belts(surfaces: SurfaceMap) -> Iterator[Finding]:
    """Yield a finding for each belt whose travel opposes that of the belt before or after it."""
    against: dict[int, set[int]] = {index: set() for index in range(len(surfaces))}
    for index in range(len(surfaces)):
        for other in _opposed(surfaces, index):
            against[index].add(other)
            against[other].add(index)
    while any(against.values()):
        # The belt with most conflicts is at fault; of equals the one that runs backwards, then the last listed.
        fault = max(against, key=lambda index: (len(against[index]), surfaces[index].speed < 0.0, index))
        names = " and ".join(surfaces[other].name for other in sorted(against[fault]))
        yield Finding(surfaces[fault].path, f"runs against {names}: their directions of travel oppose at the joint")
        for other in against.pop(fault):
            against[other].discard(fault)


def _opposed(surfaces: SurfaceMap, index: int) -> Iterator[int]:
    """Yield the belts next to both ends of a belt that oppose it."""
    if surfaces[index].rests:
        return
    middle = surfaces[index].middle
    for end, before in ((middle[-1], middle[-2]), (middle[0], middle[1])):
        outward = (end - before) / max(float(np.hypot(*(end - before))), 1e-12)
        probes = end + np.array(NEXT_TO)[:, None] * outward
        carriers = [int(carrier) for carrier in surfaces.under(probes)]
        beyond = next(((n, carrier) for n, carrier in enumerate(carriers) if carrier not in (NONE, index)), None)
        if beyond is None:
            continue
        place, other = beyond
        own = surfaces[index].heading(end[None])[0]
        theirs = surfaces[other].heading(probes[place][None])[0]
        if not surfaces[other].rests and float(own @ theirs) < OPPOSED:
            yield other


def backward_belts(scene: Scene, surfaces: SurfaceMap) -> Iterator[Finding]:
    """Yield a note that names the belts with a negative speed."""
    backwards = [surface for surface in surfaces if surface.speed < 0.0]
    if backwards:
        names = some_of(dict.fromkeys(surface.name for surface in backwards))
        text = f"negative speed, against the listed direction of travel: {names}"
        path = speed_owner(scene, str(backwards[0].path[1]))
        yield Finding((*path, "rate" if path[0] == "axes" else "speed"), text, "note")


def watchdogs(scene: Scene) -> Iterator[Finding]:
    """Yield a finding for each watchdog, which stops what it watches in a run without a controller."""
    for field, parts in (("belts", scene.belts), ("drives", scene.drives)):
        for name, part in parts.items():
            if part.watchdog is not None:
                text = f"stops it after {part.watchdog:g} s in runs without a controller that commands its speed"
                yield Finding((field, name, "watchdog"), text)


def transfer_gaps(scene: Scene, surfaces: SurfaceMap, legs: Sequence[Leg]) -> Iterator[Finding]:
    """Yield a finding for each gap between two belts that is wider than half the base of a bottle that crosses it."""
    seen: set[tuple[int, int]] = set()
    for leg in legs:
        kind = scene.bottle_types[leg.start.bottle]
        half = kind.radius if kind.base_radius is None else kind.base_radius
        for first, second, gap, place in _gaps(surfaces, leg):
            if gap > half + 1e-6 and (first, second) not in seen:
                seen.add((first, second))
                text = (
                    f"transfer gap of {in_mm(gap)} from {surfaces[first].name} at {at(place)}, expected at most "
                    f"{in_mm(half)}, half the base of bottle_types.{leg.start.bottle}"
                )
                yield Finding(surfaces[second].path, text)


def _gaps(surfaces: SurfaceMap, leg: Leg) -> Iterator[tuple[int, int, float, tuple[float, float]]]:
    """Yield gaps on the way of a bottle: surfaces before and after, width (m), beginning (m)."""
    off = leg.carriers == NONE
    for place in np.flatnonzero(off[1:] & ~off[:-1]) + 1:
        later = np.flatnonzero(~off[place:])
        before = _edge(surfaces, leg.points[place - 1], leg.points[place])
        if later.size:
            back = place + int(later[0])
            after = _edge(surfaces, leg.points[back], leg.points[back - 1])
            second = int(leg.carriers[back])
        else:
            along = leg.points[place] - leg.points[place - 1]
            along = along / max(float(np.hypot(*along)), 1e-12)
            ahead = before + np.arange(0.002, GAP_AHEAD, 0.002)[:, None] * along
            carriers = surfaces.under(ahead)
            if not (carriers != NONE).any():
                continue
            first_on = int(np.argmax(carriers != NONE))
            after, second = _edge(surfaces, ahead[first_on], before + 1e-6 * along), int(carriers[first_on])
        gap = math.dist(before, after)
        yield int(leg.carriers[place - 1]), second, gap, (float(before[0]), float(before[1]))


def _edge(surfaces: SurfaceMap, on: Array, off: Array) -> Array:
    """Return the point between a point on the belts and one beside them where the belts end."""
    for _ in range(40):
        middle = 0.5 * (on + off)
        if surfaces.under(middle[None])[0] == NONE:
            off = middle
        else:
            on = middle
    return on

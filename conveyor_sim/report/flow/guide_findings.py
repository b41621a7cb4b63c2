# SPDX-License-Identifier: Apache-2.0
"""Findings about guides: gaps that a bottle fits through, and passages that it does not fit through."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from conveyor_sim.report.flow.clearance import Clearance
from conveyor_sim.report.flow.finding import Finding, at, in_mm
from conveyor_sim.report.flow.guides import Guides, left_of
from conveyor_sim.report.flow.surfaces import NONE, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.geometry import Array, RailShape, rail_shapes
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene

LONGEST_GAP = 1.0
"""m; a longer stretch without a guide is an unguided belt."""

REFINED = 40
"""Points between two samples that locate the end of a guide."""

LOOK_AHEAD = 1.0
"""m beyond a bottle that has stopped in which a narrow passage is looked for."""

STEP = 0.1
"""Step of that search over radius."""

PLAY = 1e-4
"""m by which a passage is narrower than a bottle before it is reported; bottles give way by more."""


def guide_gaps(
    scene: Scene,
    surfaces: SurfaceMap,
    guides: Guides,
    legs: Sequence[Leg],
    clearances: Sequence[Clearance | None],
) -> Iterator[Finding]:
    """Yield a finding for each gap in a guide that a bottle fits through, with no belt behind it.

    Openings at pushers, diverters and rejects are left out: bottles are meant to pass them.
    """
    rails, openings = rail_shapes(scene), _openings(scene)
    seen: list[Array] = []
    for leg, samples in zip(legs, clearances, strict=True):
        if samples is None:
            continue
        for side in (0, 1):
            for first, last in _unguided(samples, side):
                start = _end_of_guide(samples, side, first - 1, first, guides)
                end = _end_of_guide(samples, side, last, last - 1, guides)
                width = math.dist(start, end)
                near = [*seen, *openings]
                middle = 0.5 * (start + end)
                along = float(samples.ways[last] - samples.ways[first - 1])
                # Ends that are farther apart than along the path belong to a place that widens.
                if not 2.0 * leg.radius < width < along + 2.0 * leg.radius or any(
                    math.dist(middle, other) < width + leg.radius for other in near
                ):
                    continue
                seen.append(middle)
                name = ("right", "left")[side]
                text = (
                    f"gap of {in_mm(width)} in the {name} guide from {at((start[0], start[1]))}: "
                    f"bottle_types.{leg.start.bottle} of {in_mm(2.0 * leg.radius)} fits through"
                )
                yield Finding(_rail_path(scene, rails, start), text)


def narrow_passages(scene: Scene, surfaces: SurfaceMap, guides: Guides, legs: Sequence[Leg]) -> Iterator[Finding]:
    """Yield a finding for each passage in which a bottle stops because it is too narrow."""
    rails = rail_shapes(scene)
    seen: list[Array] = []
    for leg in legs:
        if leg.end != "stopped" or len(leg.points) < 2:
            continue
        width, place, hit = _narrowest(leg, surfaces, guides)
        if width < 2.0 * leg.radius - PLAY and not any(math.dist(place, other) < leg.radius for other in seen):
            seen.append(place)
            text = (
                f"passage of {in_mm(width)} at {at((place[0], place[1]))}: bottle_types.{leg.start.bottle} "
                f"of {in_mm(2.0 * leg.radius)} does not fit through"
            )
            yield Finding(_rail_path(scene, rails, hit), text)


def _unguided(samples: Clearance, side: int) -> Iterator[tuple[int, int]]:
    """Yield first and last + 1 sample of gaps in the guide of a side, where no other belt begins."""
    guided, edges = samples.guided[side], samples.edges[side]
    changes = np.flatnonzero(guided[1:] != guided[:-1]) + 1
    for first, last in pairwise(changes.tolist()):
        if guided[first] or samples.ways[last] - samples.ways[first - 1] > LONGEST_GAP:
            continue
        beside = max(edges[first - 1], edges[last]) + samples.radius
        if edges[first:last].max() <= beside and (samples.carriers[first:last] != NONE).all():
            yield first, last


def _end_of_guide(samples: Clearance, side: int, guided: int, open_: int, guides: Guides) -> Array:
    """Return the point (m) at which the guide of a side ends between a guided and an open sample."""
    shares = np.linspace(0.0, 1.0, REFINED)[:, None]
    points = (1.0 - shares) * samples.points[guided] + shares * samples.points[open_]
    direction = left_of(samples.directions[guided][None])[0] * (1.0 if side else -1.0)
    distance = guides.distance(points, np.tile(direction, (REFINED, 1)))
    near = np.isfinite(distance) & (distance <= samples.guides[side][guided] + 2.0 * samples.radius)
    last = int(np.flatnonzero(near)[-1]) if near.any() else 0
    reach = distance[last] if np.isfinite(distance[last]) else 0.0
    seen: Array = points[last] + reach * direction
    end = guides.nearest_end(seen)
    return end if math.dist(end, seen) < samples.radius else seen


def _narrowest(leg: Leg, surfaces: SurfaceMap, guides: Guides) -> tuple[float, Array, Array]:
    """Return the least width (m) between guides ahead of a bottle that has stopped, its place and a point of a guide.

    The place follows the middle between the guides.
    """
    place, best = leg.points[-1].copy(), (math.inf, leg.points[-1], leg.points[-1])
    for _ in range(round(LOOK_AHEAD / (STEP * leg.radius))):
        carrier = int(surfaces.under(place[None])[0])
        if carrier == NONE:
            break
        along = surfaces[carrier].heading(place[None])
        left = left_of(along)
        to_left, to_right = float(guides.distance(place[None], left)[0]), float(guides.distance(place[None], -left)[0])
        if not (math.isfinite(to_left) and math.isfinite(to_right)):
            break
        width = to_left + to_right
        if width < best[0]:
            middle = place + 0.5 * (to_left - to_right) * left[0]
            best = width, middle, place + to_left * left[0]
        if float(guides.distance(place[None], along)[0]) < STEP * leg.radius:
            break
        place = place + 0.5 * (to_left - to_right) * left[0] + STEP * leg.radius * along[0]
    return best


def _openings(scene: Scene) -> list[Array]:
    """Return places (m) at which bottles are meant to leave sideways."""
    places = [np.array(part.region).mean(axis=0) for part in scene.machines.values() if isinstance(part, Reject)]
    for path, mover in movers_of(scene):
        bodies, axis = mover_shape(path, mover)
        pieces = (piece for place in (0.0, axis.stroke) for body in bodies for piece in body.at(place))
        places += [np.mean(piece.ends, axis=0) for piece in pieces]
    return places


def _rail_path(scene: Scene, rails: Sequence[RailShape], point: Array) -> Path:
    """Return the path of the rail that is nearest to a point (m)."""
    apart = [min(float(piece.distance(point[None])[0]) for piece in rail.pieces) for rail in rails]
    name = rails[int(np.argmin(apart))].name
    return ("rails", name) if name in scene.rails else ("belts", name.rpartition("_")[0], "rails")

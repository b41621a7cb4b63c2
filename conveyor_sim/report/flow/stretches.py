# SPDX-License-Identifier: Apache-2.0
"""Stretches of a line between changes of belt and width: how many bottles they hold, and how many pass in a second."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from conveyor_sim.report.flow.clearance import SPACING, Clearance
from conveyor_sim.report.flow.routes import TransitRoute
from conveyor_sim.report.flow.surfaces import NONE, Indices, Mask, SurfaceMap
from conveyor_sim.report.flow.trace import Leg
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene

PACKING = 0.9
"""Share of the densest packing that bottles reach in a wide place."""

SHORTEST = 2.0
"""Length over radius below which a stretch joins its neighbour on the same belt."""


@dataclass(frozen=True)
class Stretch:
    """Part of a path on one belt, in single file or wide."""

    name: str
    path: Path
    """Path of the belt in the scene."""
    length: float
    """m"""
    width: float
    """Mean clear width, m."""
    single: bool
    """True where bottles go in single file."""
    capacity: float
    """Bottles: length over diameter in single file, else 0.9 x area / (2 sqrt(3) R^2)."""
    rate: float
    """Bottles/s that pass at the speed of the belt."""


@dataclass(frozen=True)
class Bottleneck:
    """Lowest rate that limits a line."""

    name: str
    path: Path
    rate: float
    """Bottles/s."""


def stretches_of(
    legs: Sequence[Leg],
    clearances: Sequence[Clearance | None],
    surfaces: SurfaceMap,
    pitches: Mapping[str, float],
) -> tuple[Stretch, ...]:
    """Return the stretches of all legs in order. Legs from entries share stretches: the longest stands for all.

    pitches: distance (m) of bottles on surfaces where pockets space them, by name.
    """
    longest: dict[tuple[str, bool], Stretch] = {}
    for leg, samples in zip(legs, clearances, strict=True):
        for stretch in _along(leg, samples, surfaces, pitches) if samples is not None else ():
            key = (stretch.name, stretch.single)
            if key not in longest or stretch.length > longest[key].length:
                longest[key] = stretch
    return tuple(longest.values())


def bottleneck(scene: Scene, routes: Sequence[TransitRoute], stretches: Sequence[Stretch]) -> Bottleneck | None:
    """Return the lowest rate of stretches and machines on the way to an exit; None without one."""
    on_the_way = {stop for route in routes for stop in route.stops[1:]}
    limits = [
        Bottleneck(name, ("machines", name), part.rate)
        for name, part in scene.machines.items()
        if isinstance(part, PackmlPart) and ("machines", name) in on_the_way
    ]
    limits += [Bottleneck(stretch.name, stretch.path, stretch.rate) for stretch in stretches if stretch.rate > 0.0]
    return min(limits, key=lambda limit: limit.rate, default=None)


def feed_rate(scene: Scene, path: Path) -> float:
    """Return the rate of an entry at the start, bottles/s; 0 for an entry that does not feed by itself."""
    part = scene.named()[str(path[0])][str(path[1])] if path[0] in ("infeeds", "machines") else None
    if isinstance(part, Source):
        return part.rate
    if isinstance(part, Infeed):
        if part.rate is not None:
            return part.rate
        pitch = 2.0 * scene.bottle_types[part.bottle].radius + (part.gap or 0.0)
        return part.speed / pitch
    return 0.0


def _along(leg: Leg, samples: Clearance, surfaces: SurfaceMap, pitches: Mapping[str, float]) -> Iterator[Stretch]:
    spacing = SPACING * leg.radius
    wide = _steady(samples)
    for first, last in _equal(np.column_stack([samples.carriers, wide])):
        index = int(samples.carriers[first])
        if index == NONE:
            continue
        surface, single = surfaces[index], not wide[first]
        length, width = (last - first) * spacing, samples.width[first:last]
        speed = abs(surface.running)
        if single:
            pitch = pitches.get(surface.name, 2.0 * leg.radius)
            capacity, rate = length / pitch, speed / pitch
        else:
            density = PACKING / (2.0 * math.sqrt(3.0) * leg.radius**2)
            capacity, rate = density * length * float(width.mean()), density * speed * float(width.min())
        name = f"{surface.name} after {leg.start.path[1]}" if leg.start.returned else surface.name
        yield Stretch(name, surface.path, length, float(width.mean()), single, capacity, rate)


def _steady(samples: Clearance) -> Mask:
    """Return True where two rows fit, without changes over less than SHORTEST on one belt, (k,)."""
    wide = samples.wide.copy()
    for first, last in _equal(np.column_stack([samples.carriers, wide])):
        joins = first > 0 and samples.carriers[first - 1] == samples.carriers[first]
        if joins and last - first < SHORTEST / SPACING:
            wide[first:last] = wide[first - 1]
    return wide


def _equal(rows: Indices) -> Iterator[tuple[int, int]]:
    """Yield first and last + 1 of runs of equal rows."""
    changes = np.flatnonzero((rows[1:] != rows[:-1]).any(axis=1)) + 1
    bounds = [0, *changes.tolist(), len(rows)]
    yield from pairwise(bounds)

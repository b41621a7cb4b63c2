# SPDX-License-Identifier: Apache-2.0
"""Longest queue that a line has room for: a chain of touching bottles along the flow, not the number of a wide crowd.

Surfaces that follow each other hold one chain, from where it can begin to the rail that stops it. A rail across a
surface ends the chain. Lanes side by side with one direction hold chains beside each other; those in opposite
directions can hold one. Surfaces between which bottles can go round count once each. Gates count as open, and pockets
of wheels and screws as filled with touching bottles, so that the result is an upper limit.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.physics.effects.load import NARROW, ROWS
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.driven import belt_speeds
from conveyor_sim.scene.geometry import BeltShape, SegmentPiece, is_full_turn

F8 = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class _Stretch:
    """A surface, or its part between two rails across it."""

    shape: BeltShape
    """Area of the axes of bottles: a rail keeps them a radius away."""
    length: float
    """Room for bottles along it, m."""
    backwards: bool
    """True if its belt starts backwards."""

    @property
    def label(self) -> str:
        """Name of its belt or plate."""
        return self.shape.belt_name or self.shape.name

    def end(self, spacing: float) -> F8 | None:
        """Return points across its downstream end, (k, 2), at most `spacing` (m) apart; None for one without an end.

        Plates and full turns have no end.
        """
        shape = self.shape
        if shape.belt is None or (shape.kind == "curved" and is_full_turn(shape.span)):
            return None
        right, left = (edge[0 if self.backwards else -1] for edge in shape.edges())
        return np.asarray(np.linspace(right, left, 1 + math.ceil(shape.width / spacing)))


def longest_queue(plant: Plant) -> tuple[int, str]:
    """Return the bottles, one behind the other, in the longest queue that a line has room for, and why.

    It is the smaller of two numbers: the bottles of a run in single file, and the rows of the longest chain. It is 0
    without bottles or belts.
    """
    most = plant.supply
    if not most or all(shape.belt is None for shape in plant.surfaces):
        return 0, "no belt carries bottles"
    diameter = 2.0 * min(plant.scene.bottle_types[name].radius for name in most)
    stretches = list(_stretches(plant, 0.5 * diameter))
    rows = np.array([one.length / _pitch(one.shape, diameter) for one in stretches])
    chain = _longest_chain(rows, _leads_to(stretches, 0.5 * diameter))
    count, room = sum(most.values()), float(rows[chain].sum())
    if count <= room:
        return round(count), "all bottles, one behind the other"
    length = sum(stretches[index].length for index in chain)
    first, last = stretches[chain[0]].label, stretches[chain[-1]].label
    place = first if first == last else f"{first} to {last}"
    return max(1, math.floor(room + 1e-9)), f"{length:.3g} m of {place}, full"


def _pitch(shape: BeltShape, diameter: float) -> float:
    """Return the distance of bottles behind each other along a surface, m."""
    return diameter * (1.0 if shape.width <= NARROW * diameter else ROWS)


def _stretches(plant: Plant, radius: float) -> Iterator[_Stretch]:
    """Yield the parts of all surfaces between rails across them. radius: of the smallest bottle, m."""
    backwards = {name for name, speed in belt_speeds(plant.scene).items() if speed < 0.0}
    for shape in plant.surfaces:
        back = shape.belt_name in backwards
        rails = () if shape.kind == "curved" else plant.rails_at_rest
        cuts = sorted(
            at
            for rail in rails
            for piece in rail.pieces
            if isinstance(piece, SegmentPiece) and (at := _crossing(shape, piece, radius)) is not None
        )
        if not cuts:
            yield _Stretch(shape, shape.running_length, back)
            continue
        for begin, end in pairwise([0.0, *cuts, shape.length]):
            first = begin + radius if begin else 0.0
            last = end - radius if end < shape.length else end
            if last > first:
                yield _Stretch(_part(shape, first, last), end - begin, back)


def _part(shape: BeltShape, first: float, last: float) -> BeltShape:
    """Return a part of a straight surface between two coordinates along it, m."""
    along = np.array([math.cos(shape.angle), math.sin(shape.angle)])
    x, y = (np.array(shape.corner) + first * along).tolist()
    return replace(shape, corner=(x, y), length=last - first)


def _crossing(shape: BeltShape, piece: SegmentPiece, radius: float) -> float | None:
    """Return where a piece of a rail closes a straight surface, along it, m; None if a bottle can pass or slide along.

    radius: of the smallest bottle, m.
    """
    (xi1, eta1), (xi2, eta2) = _coordinates(shape, np.array(piece.ends)).tolist()
    right, left = min(eta1, eta2), max(eta1, eta2)
    at = 0.5 * (xi1 + xi2)
    closes = right < 2.0 * radius and left > shape.width - 2.0 * radius and abs(xi2 - xi1) < min(radius, left - right)
    return at if closes and 0.0 < at < shape.length else None


def _coordinates(shape: BeltShape, points: F8) -> F8:
    """Return coordinates (k, 2) of points along and across a straight surface, from its corner, m."""
    cos, sin = math.cos(shape.angle), math.sin(shape.angle)
    seen = points - np.array(shape.corner)
    return np.column_stack([cos * seen[:, 0] + sin * seen[:, 1], cos * seen[:, 1] - sin * seen[:, 0]])


def _leads_to(stretches: Sequence[_Stretch], reach: float) -> Flags:
    """Return which stretch a chain on another can go on to, (from, to). reach: greatest gap between them, m.

    It can't go on to a belt that ends beside it, unless this runs against it.
    """
    outlines = [one.shape.outline() for one in stretches]
    ends = [one.end(reach) for one in stretches]
    least, most = (np.array([find(outline, axis=0) for outline in outlines]) for find in (np.min, np.max))
    near = ((least[:, None] - most[None, :]) <= reach).all(axis=2)
    leads = np.zeros(near.shape, bool)
    for a, b in np.argwhere(near & near.T).tolist():
        first, second = stretches[a], stretches[b]
        gap = min(_apart(first.shape, outlines[b]), _apart(second.shape, outlines[a]))
        if a == b or gap > reach:
            continue
        end = ends[b]
        leads[a, b] = end is None or _apart(first.shape, end) > reach or _against(first, second)
    return leads


def _against(first: _Stretch, second: _Stretch) -> bool:
    """Return True for two straight belts that run in opposite directions."""
    if any(one.shape.kind == "curved" or one.shape.belt is None for one in (first, second)):
        return False
    same = math.cos(first.shape.angle - second.shape.angle)
    return (-same if first.backwards != second.backwards else same) < -0.5


def _apart(shape: BeltShape, points: F8) -> float:
    """Return the least distance of points (k, 2) from an area, m; exact for straight ones."""
    if shape.kind == "straight":
        beyond = np.abs(_coordinates(shape, points) - 0.5 * np.array([shape.length, shape.width]))
        outside = np.maximum(beyond - 0.5 * np.array([shape.length, shape.width]), 0.0)
        return float(np.hypot(outside[:, 0], outside[:, 1]).min())
    seen = points - np.array(shape.centre)
    radius = np.hypot(seen[:, 0], seen[:, 1])
    across = np.maximum(np.abs(radius - shape.centre_radius) - 0.5 * shape.width, 0.0)
    turned = np.mod(np.arctan2(seen[:, 1], seen[:, 0]) - shape.start_angle, 2.0 * math.pi)
    past = np.maximum(np.minimum(turned - shape.span, 2.0 * math.pi - turned), 0.0)
    return float(np.hypot(across, past * radius).min())


def _longest_chain(rows: F8, leads: Flags) -> list[int]:
    """Return the stretches of the chain with most rows, in order. rows: (n,). leads: (from, to), (n, n)."""
    reach = leads | np.eye(len(rows), dtype=bool)
    for middle in range(len(rows)):
        reach |= np.outer(reach[:, middle], reach[middle])
    both = reach & reach.T
    best: dict[int, tuple[float, list[int]]] = {}
    for one in np.argsort(reach.sum(axis=1), kind="stable").tolist():
        beyond = [best[index] for index in np.flatnonzero(reach[one] & ~both[one]).tolist()]
        room, chain = max(beyond, key=lambda found: found[0], default=(0.0, []))
        members = np.flatnonzero(both[one]).tolist()
        best[one] = room + float(rows[members].sum()), members + chain
    return max(best.values(), key=lambda found: found[0])[1]

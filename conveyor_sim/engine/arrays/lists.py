# SPDX-License-Identifier: Apache-2.0
"""Lists of neighbours, which a rebuild renews."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.impulses import NearImpulses
from conveyor_sim.engine.arrays.types import F8, I4, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class BottleList(NamedTuple):
    """Some of the bottles, in order; unit u (`workers.py`) has bottle[first[u]:first[u + 1]]."""

    bottle: U4
    first: U4


@group
class NearSprings(NamedTuple):
    """Tangential springs by entry of a Near list, and a copy by bottle and piece that survives a rebuild."""

    elongation: F8
    """Elongation in m, or friction in N (`PairSprings.elongation`)."""
    kept_bottle: U4
    kept_piece: U4
    kept: F8
    kept_count: I8
    """(1,)"""


@group
class Near(NamedTuple):
    """Rail pieces, or bodies, near each bottle: slot s has piece[start[s]:start[s + 1]], in order."""

    start: U4
    piece: U4
    springs: NearSprings | None
    impulse: NearImpulses | None


@group
class Ways(NamedTuple):
    """Ways of bottles until the next rebuild, least + time v, at most `most` (`ways.py`)."""

    way: F8
    """m, (S,)."""
    least: float
    """m"""
    time: float
    """s"""
    most: float
    """m"""


@group
class CoarseList(NamedTuple):
    """Pairs within twice the skin, from a search of the cells (`coarse.py`)."""

    x: F8
    """Positions at this search, (S,)."""
    y: F8
    radius: F8
    """Radii at this search; -1: the slot was free, (S,)."""
    number: I8
    """Cells in the order of `Neighbourhood.order`, as one number each, (S,)."""
    start: U4
    """Slot i has j[start[i]:start[i + 1]], in order, j > i, (S + 1,)."""
    j: U4
    spent: I8
    """Sum of strays over the rebuilds since this search, (1,); -1: search at the next rebuild."""
    stray: I8
    """Scratch of a rebuild: 1 if a bottle has moved too far since this search, or its slot has changed, or if it is
    fast, (S,)."""
    strays: U4
    """Scratch of a rebuild: slots of strays, (S,)."""
    cell_stray: I4
    """Scratch of a rebuild: last stray in each hashed cell, (buckets,); -1: none."""
    same_cell: I4
    """Scratch of a rebuild: stray before in the same hashed cell, (S,)."""
    last: I4
    """Scratch of a rebuild: last pair of each slot with a stray, (S,); -1: none."""
    before: I4
    """Scratch of a rebuild: pair before of the same slot, and the other slot, by pair with a stray."""
    other: U4


@group
class Neighbourhood(NamedTuple):
    """Data of a rebuild."""

    x: F8
    """Positions at the last rebuild, (S,)."""
    y: F8
    stale: I8
    """Not 0: a rebuild is due, (1,)."""
    cell: I8
    """Cell coordinates, (S, 2)."""
    bucket: U4
    """Starts of the hashed cells in `order`, (buckets + 1,); the number of buckets is a power of two."""
    order: U4
    """Slots by bucket, (S,)."""
    sorted_x: F8
    """Scratch of a rebuild, in the order of `order`: positions, radii, and cells as one number each, (S,)."""
    sorted_y: F8
    sorted_radius: F8
    sorted_cell: I8
    ways: Ways | None
    """None with integrators whose lists are rebuilt rarely: each bottle may move by half of the skin then."""
    coarse: CoarseList | None
    """None without ways."""
    home: I4
    """Scratch of a rebuild: cell of the static grid under each bottle, (S,); -1: none, or a free slot."""


@group
class StaticGrid(NamedTuple):
    """Cells over the plant; each lists the parts within reach of a bottle whose axis is in it."""

    x: float
    y: float
    size: float
    columns: int
    rows: int
    segment_start: U4
    segment: U4
    arc_start: U4
    arc: U4
    belt_start: U4
    belt: U4
    body_start: U4
    body: U4

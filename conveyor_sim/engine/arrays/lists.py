"""Lists of what is near, made anew at a rebuild."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Listed(NamedTuple):
    """Some of the bottles, in order; those of the u-th unit (`workers.py`) are bottle[first[u]:first[u + 1]]."""

    bottle: U4
    first: U4


@group
class NearSprings(NamedTuple):
    """Tangential springs by entry of a Near list, and a copy by bottle and piece that outlives a rebuild."""

    elongation: F8
    kept_bottle: U4
    kept_piece: U4
    kept: F8
    kept_count: I8
    """(1,)"""


@group
class Near(NamedTuple):
    """Rail pieces near each bottle: those of slot s are piece[start[s]:start[s + 1]], in order."""

    start: U4
    piece: U4
    springs: NearSprings | None


@group
class Neighbourhood(NamedTuple):
    """What a rebuild needs and leaves behind."""

    x: F8
    """(S,), where each bottle was at the last rebuild."""
    y: F8
    stale: I8
    """(1,), not 0: a rebuild is due."""
    cell: I8
    """(S, 2), cell coordinates."""
    bucket: U4
    """(buckets + 1,), starts of the hashed cells in `order`; the number of buckets is a power of two."""
    order: U4
    """(S,), slots by bucket."""


@group
class StaticGrid(NamedTuple):
    """Cells over the plant; each lists what a bottle with its axis in it can come near: pieces and belts."""

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

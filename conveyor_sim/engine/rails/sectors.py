# SPDX-License-Identifier: Apache-2.0
"""Clusters of a body by sector around its pivot: a bottle near a wheel tests the pockets beside it, not all."""

from typing import Any

from conveyor_sim.engine.arrays.moving import ClusterSectors, MovingBodies
from conveyor_sim.engine.compiler.compile import part


@part
def clusters_beside(moving: MovingBodies, sectors: Any, b: int, x: float, y: float) -> tuple[int, int]:
    """Return the range of places (`cluster_at`) of the clusters of body b that can touch a bottle.

    x, y: place of the bottle relative to the pivot in the frame of the body, m.
    """
    if sectors is None:
        return moving.first_cluster[b], moving.first_cluster[b + 1]
    return _places(sectors, b, x, y)


@part
def _places(sectors: ClusterSectors, b: int, x: float, y: float) -> tuple[int, int]:
    first = sectors.first[b]
    s = first + sector_at(x, y, sectors.first[b + 1] - first)
    return sectors.start[s], sectors.start[s + 1]


@part
def cluster_at(sectors: Any, place: int) -> int:
    """Return the cluster at a place."""
    if sectors is None:
        return place
    return sectors.cluster[place]


@part
def sector_at(x: float, y: float, count: int) -> int:
    """Return the sector of a direction among `count` ones, by y / (|x| + |y|), which needs no arctangent."""
    size = abs(x) + abs(y)
    if count == 1 or size == 0.0:
        return 0
    share = y / size
    if x < 0.0:
        share = 2.0 - share
    elif share < 0.0:
        share += 4.0
    return min(int(0.25 * share * count), count - 1)

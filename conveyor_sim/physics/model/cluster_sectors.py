# SPDX-License-Identifier: Apache-2.0
"""Clusters of pieces by sector around the pivots of bodies."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.moving import Clusters, ClusterSectors
from conveyor_sim.engine.rails.sectors import sector_at

MANY = 6
"""Clusters from which a body has sectors: with fewer, a bottle tests all of them."""

ROUNDING = 1e-9
"""rad"""

_sector: Any = sector_at.py_func  # type: ignore[attr-defined]


def cluster_sectors(clusters: Clusters, first_cluster: NDArray[np.int32], radius: float) -> ClusterSectors | None:
    """Return the sectors of all bodies, one of a body with few clusters; None if all have few. radius: largest, m."""
    if np.diff(first_cluster).max(initial=0) < MANY:
        return None
    lists: list[list[int]] = []
    first = [0]
    for begin, end in zip(first_cluster[:-1].tolist(), first_cluster[1:].tolist(), strict=True):
        count = 1 if end - begin < MANY else 2 * (end - begin)
        own: list[list[int]] = [[] for _ in range(count)]
        for k in range(begin, end):
            for s in _sectors(float(clusters.x[k]), float(clusters.y[k]), float(clusters.radius[k]) + radius, count):
                own[s].append(k)
        lists += own
        first.append(len(lists))
    return ClusterSectors(
        first=np.array(first, np.int32),
        start=np.cumsum([0, *(len(own) for own in lists)]).astype(np.int32),
        cluster=np.array([k for own in lists for k in own], np.int32),
    )


def _sectors(x: float, y: float, reach: float, count: int) -> list[int]:
    """Return the sectors in which a place within a distance (m) of (x, y) can be; all if the pivot can."""
    distance = math.hypot(x, y)
    if distance <= reach * (1.0 + ROUNDING):
        return list(range(count))
    middle, half = math.atan2(y, x), math.asin(reach / distance) + ROUNDING
    low, high = (_sector(math.cos(angle), math.sin(angle), count) for angle in (middle - half, middle + half))
    return [s % count for s in range(low, high + 1 if high >= low else high + count + 1)]

# SPDX-License-Identifier: Apache-2.0
"""Sectors of bodies: every cluster that a bottle can touch is in the list of its sector, in ascending order."""

import math

import numpy as np
import pytest

from conveyor_sim.engine.arrays.moving import Clusters
from conveyor_sim.engine.rails.sectors import sector_at
from conveyor_sim.physics.model.cluster_sectors import cluster_sectors

RADIUS = 0.033


def wheel(pockets: int, pitch_radius: float, turned: float) -> Clusters:
    """Return the clusters of a wheel, and one in its middle."""
    angle = turned + 2.0 * math.pi * np.arange(pockets) / pockets
    x, y = np.append(pitch_radius * np.cos(angle), 0.0), np.append(pitch_radius * np.sin(angle), 0.0)
    ends = np.zeros(pockets + 2, np.int32)
    return Clusters(x=x, y=y, radius=np.full(pockets + 1, 0.05), segment=ends, arc=ends)


@pytest.mark.parametrize(("pockets", "pitch_radius"), [(6, 0.12), (12, 0.3), (48, 1.2)])
@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_no_cluster_within_reach_is_left_out(pockets: int, pitch_radius: float, turned: float) -> None:
    """Places all over the wheel; on average the lists of the large one are short."""
    clusters = wheel(pockets, pitch_radius, turned)
    sectors = cluster_sectors(clusters, np.array([0, pockets + 1], np.int32), RADIUS)
    assert sectors is not None
    count = int(sectors.first[-1])
    random = np.random.default_rng(1)
    for x, y in random.uniform(-1.2 * pitch_radius, 1.2 * pitch_radius, (2000, 2)).tolist():
        s = sector_at.py_func(x, y, count)  # type: ignore[attr-defined]
        listed = sectors.cluster[sectors.start[s] : sectors.start[s + 1]].tolist()
        touched = np.flatnonzero(np.hypot(clusters.x - x, clusters.y - y) <= clusters.radius + RADIUS).tolist()
        assert set(touched) <= set(listed)
        assert listed == sorted(set(listed))
    if pockets == 48:
        assert sectors.cluster.size < 6 * count


def test_bodies_of_few_clusters_have_one_sector_or_none() -> None:
    """Without a body of many clusters there are no sectors; beside one, others list all their clusters."""
    clusters = wheel(12, 0.3, 0.0)
    assert cluster_sectors(clusters, np.array([0, 5, 10, 13], np.int32), RADIUS) is None
    sectors = cluster_sectors(clusters, np.array([0, 4, 13], np.int32), RADIUS)
    assert sectors is not None
    assert sectors.first.tolist() == [0, 1, 19]
    assert sectors.cluster[: sectors.start[1]].tolist() == [0, 1, 2, 3]

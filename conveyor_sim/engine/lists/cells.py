# SPDX-License-Identifier: Apache-2.0
"""Hashed cells: bottles sorted by square cell, so that neighbours are in nine cells."""

import math

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import Neighbourhood
from conveyor_sim.engine.compiler.compile import fill, part


@part
def bucket_of(cx: int, cy: int, buckets: int) -> int:
    """Return the bucket of a cell. Different cells may share one, so a member's own cell must still be compared."""
    return (cx * 73856093 ^ cy * 19349663) & (buckets - 1)


@part
def number_of(cx: int, cy: int) -> int:
    """Return a number that no other cell has."""
    return (cx << 32) + cy


@part
def sort_into_cells(bottles: Bottles, hood: Neighbourhood, cell: float) -> None:
    """Sort the occupied slots by hashed cell (counting sort)."""
    buckets = hood.bucket.size - 1
    fill(hood.bucket, 0)
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            hood.cell[i, 0] = math.floor(bottles.x[i] / cell)
            hood.cell[i, 1] = math.floor(bottles.y[i] / cell)
            hood.bucket[bucket_of(hood.cell[i, 0], hood.cell[i, 1], buckets)] += 1
    total = 0
    for b in range(buckets + 1):
        total += hood.bucket[b]
        hood.bucket[b] = total
    # Backwards: each entry of `bucket` ends as the start of its bucket, and slots ascend within a bucket.
    for i in range(bottles.x.size - 1, -1, -1):
        if bottles.id[i] >= 0:
            b = bucket_of(hood.cell[i, 0], hood.cell[i, 1], buckets)
            hood.bucket[b] -= 1
            place = hood.bucket[b]
            hood.order[place] = i
            hood.sorted_x[place] = bottles.x[i]
            hood.sorted_y[place] = bottles.y[i]
            hood.sorted_radius[place] = bottles.radius[i]
            hood.sorted_cell[place] = number_of(hood.cell[i, 0], hood.cell[i, 1])

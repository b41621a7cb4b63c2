# SPDX-License-Identifier: Apache-2.0
"""Grid over the plant, made once: rail pieces, belts and bodies within reach of a bottle whose axis is in a cell."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import I4
from conveyor_sim.engine.compiler.compile import part

MOST_CELLS = 250_000


def build_static_grid(
    segments: NDArray[np.float64],
    arcs: NDArray[np.float64],
    belts: NDArray[np.float64],
    bodies: NDArray[np.float64],
    rail_reach: float,
    belt_reach: float,
    cell: float,
) -> StaticGrid:
    """Build the grid.

    segments, arcs, belts, bodies: (n, 4) bounding boxes x_min, y_min, x_max, y_max, m, of the sweep of a body.
    rail_reach: m, largest distance of an axis from a rail or a body at which it matters (radius and skin); belt_reach
    likewise for belts. cell: m, desired edge of a cell; it is larger if the plant would need more than MOST_CELLS.
    Rails and bodies are listed in order, belts in reverse.
    """
    rails = np.concatenate([segments, arcs, bodies]) + np.array([-rail_reach, -rail_reach, rail_reach, rail_reach])
    carriers = belts + np.array([-belt_reach, -belt_reach, belt_reach, belt_reach])
    boxes = np.concatenate([rails, carriers])
    x, y = float(boxes[:, 0].min()), float(boxes[:, 1].min())
    width, height = float(boxes[:, 2].max()) - x, float(boxes[:, 3].max()) - y
    size = max(cell, math.sqrt(width * height / MOST_CELLS), max(width, height) / MOST_CELLS)
    columns, rows = int(width / size) + 1, int(height / size) + 1

    def fill(group: NDArray[np.float64], order: range) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        """Return the items in each cell, one cell after the other, and the start of each cell's items."""
        first = ((group[:, :2] - (x, y)) / size).astype(np.int64)
        last = np.minimum(((group[:, 2:] - (x, y)) / size).astype(np.int64), (columns - 1, rows - 1))
        blocks = [
            np.arange(first[item, 1], last[item, 1] + 1)[:, None] * columns
            + np.arange(first[item, 0], last[item, 0] + 1)
            for item in order
        ]
        cells = np.concatenate([np.zeros(0, np.int64), *(block.ravel() for block in blocks)])
        items = np.repeat(np.array(order, dtype=np.uint32), [block.size for block in blocks])
        start = np.zeros(columns * rows + 1, dtype=np.uint32)
        start[1:] = np.cumsum(np.bincount(cells, minlength=columns * rows))
        return start, items[np.argsort(cells, kind="stable")]

    straight, fixed = len(segments), len(segments) + len(arcs)
    segment_start, segment = fill(rails[:straight], range(straight))
    arc_start, arc = fill(rails[straight:fixed], range(len(arcs)))
    body_start, body = fill(rails[fixed:], range(len(bodies)))
    belt_start, belt = fill(carriers, range(len(belts) - 1, -1, -1))
    return StaticGrid(
        x, y, size, columns, rows, segment_start, segment, arc_start, arc, belt_start, belt, body_start, body
    )


@part
def find_homes(bottles: Bottles, grid: Any, home: I4) -> None:
    """Write the cell of the static grid under each bottle, -1 for free slots and bottles outside."""
    if grid is None:
        return
    for i in range(bottles.x.size):
        home[i] = cell_at(grid, bottles.x[i], bottles.y[i]) if bottles.id[i] >= 0 else -1


@part
def cell_at(grid: Any, x: float, y: float) -> int:
    """Return the cell of the static grid under a point; -1 outside, where nothing of the plant is near."""
    if not (x >= grid.x and y >= grid.y):
        return -1
    column = (x - grid.x) / grid.size
    row = (y - grid.y) / grid.size
    if not (column < grid.columns and row < grid.rows):
        return -1
    return int(row) * grid.columns + int(column)

"""A grid over the plant, made once: which rail pieces and belts a bottle with its axis in a cell can come near."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.compiler.compile import part

MOST_CELLS = 250_000


def build_static_grid(
    segments: NDArray[np.float64],
    arcs: NDArray[np.float64],
    belts: NDArray[np.float64],
    rail_reach: float,
    belt_reach: float,
    cell: float,
) -> StaticGrid:
    """Build the grid.

    segments, arcs, belts: (n, 4) bounding boxes x_min, y_min, x_max, y_max, m. rail_reach: m, how far from a rail an
    axis can be and matter (radius and skin); belt_reach likewise for belts. cell: m, wanted edge of a cell; larger
    where the plant would need more than MOST_CELLS. Belts are listed last first, rails in order.
    """
    rails = np.concatenate([segments, arcs]) + np.array([-rail_reach, -rail_reach, rail_reach, rail_reach])
    carriers = belts + np.array([-belt_reach, -belt_reach, belt_reach, belt_reach])
    boxes = np.concatenate([rails, carriers])
    x, y = float(boxes[:, 0].min()), float(boxes[:, 1].min())
    width, height = float(boxes[:, 2].max()) - x, float(boxes[:, 3].max()) - y
    size = max(cell, math.sqrt(width * height / MOST_CELLS), max(width, height) / MOST_CELLS)
    columns, rows = int(width / size) + 1, int(height / size) + 1

    def fill(group: NDArray[np.float64], order: range) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        cells: list[list[int]] = [[] for _ in range(columns * rows)]
        for item in order:
            low_x, low_y, high_x, high_y = group[item]
            for row in range(int((low_y - y) / size), min(int((high_y - y) / size), rows - 1) + 1):
                for column in range(int((low_x - x) / size), min(int((high_x - x) / size), columns - 1) + 1):
                    cells[row * columns + column].append(item)
        start = np.zeros(columns * rows + 1, dtype=np.uint32)
        start[1:] = np.cumsum([len(entry) for entry in cells])
        return start, np.array([item for entry in cells for item in entry], dtype=np.uint32)

    count = len(segments)
    segment_start, segment = fill(rails[:count], range(count))
    arc_start, arc = fill(rails[count:], range(len(arcs)))
    belt_start, belt = fill(carriers, range(len(belts) - 1, -1, -1))
    return StaticGrid(x, y, size, columns, rows, segment_start, segment, arc_start, arc, belt_start, belt)


@part
def static_cell(grid: Any, x: float, y: float) -> int:
    """Cell of the static grid under a point, -1 outside: nothing of the plant is near there."""
    if not (x >= grid.x and y >= grid.y):
        return -1
    column = (x - grid.x) / grid.size
    row = (y - grid.y) / grid.size
    if not (column < grid.columns and row < grid.rows):
        return -1
    return int(row) * grid.columns + int(column)

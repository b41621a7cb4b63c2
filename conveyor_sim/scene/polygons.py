# SPDX-License-Identifier: Apache-2.0
"""Polygons: points inside, and simplicity: no side without length, no two sides that meet."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.types import TOUCH, XY


def inside(points: NDArray[np.float64], corners: Sequence[XY] | NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return True for points (k, 2) in a polygon (even-odd rule), (k,)."""
    x, y = points.T
    found = np.zeros(len(points), dtype=bool)
    ends = np.asarray(corners, dtype=np.float64)
    for (x1, y1), (x2, y2) in zip(ends.tolist(), np.roll(ends, -1, axis=0).tolist(), strict=True):
        if y1 != y2:
            found ^= ((y1 > y) != (y2 > y)) & (x < x1 + (x2 - x1) * (y - y1) / (y2 - y1))
    return found


def boxes_meet(one: Sequence[XY] | NDArray[np.float64], other: Sequence[XY] | NDArray[np.float64]) -> bool:
    """Return True if the boxes around two polygons, (n, 2), have a common point: if not, the polygons have none."""
    first, second = np.asarray(one, dtype=np.float64), np.asarray(other, dtype=np.float64)
    after = (first.min(axis=0) > second.max(axis=0)).any()
    return not (after or (second.min(axis=0) > first.max(axis=0)).any())


def why_not_simple(corners: tuple[XY, ...]) -> str | None:
    """Return why a polygon is not simple, or None if it is."""
    sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
    for index, (start, end) in enumerate(sides):
        if math.dist(start, end) <= TOUCH:
            return f"side {index + 1} has no length"
    boxes = [_box(*side) for side in sides]
    for i, one in enumerate(sides):
        left, below, right, above = boxes[i]
        for j in range(i + 1, len(sides)):
            box = boxes[j]
            # Most sides are far apart, and only the others are worth a closer look.
            if box[0] > right or box[2] < left or box[1] > above or box[3] < below:
                continue
            neighbours = j == i + 1 or (i == 0 and j == len(sides) - 1)
            if _fold_back(one, sides[j]) if neighbours else _touch(one, sides[j]):
                return f"sides {i + 1} and {j + 1} meet"
    return None


def _box(start: XY, end: XY) -> tuple[float, float, float, float]:
    """Return least x and y and greatest x and y of points within touching distance of a side."""
    (x1, y1), (x2, y2) = start, end
    return min(x1, x2) - TOUCH, min(y1, y2) - TOUCH, max(x1, x2) + TOUCH, max(y1, y2) + TOUCH


def _fold_back(one: tuple[XY, XY], other: tuple[XY, XY]) -> bool:
    """Return True if two sides with a common corner lie on each other."""
    common, first = (one[1], one[0]) if one[1] == other[0] else (one[0], one[1])
    second = other[1] if common == other[0] else other[0]
    away = (first[0] - common[0]) * (second[0] - common[0]) + (first[1] - common[1]) * (second[1] - common[1])
    return away > 0 and _turn(common, first, second) == 0


def _touch(one: tuple[XY, XY], other: tuple[XY, XY]) -> bool:
    (a, b), (c, d) = one, other
    if _turn(a, b, c) != _turn(a, b, d) and _turn(c, d, a) != _turn(c, d, b):
        return True
    ends = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(_turn(*three) == 0 and _between(*three) for three in ends)


def _turn(a: XY, b: XY, c: XY) -> int:
    """Return the sign of the turn a to b to c; 0 if c is within touching distance of the line."""
    cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return 0 if abs(cross) <= TOUCH * math.dist(a, b) else (1 if cross > 0 else -1)


def _between(a: XY, b: XY, point: XY) -> bool:
    return all(min(a[k], b[k]) - TOUCH <= point[k] <= max(a[k], b[k]) + TOUCH for k in (0, 1))

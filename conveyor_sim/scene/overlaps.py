# SPDX-License-Identifier: Apache-2.0
"""Search for overlapping circles, and for points near rails: by cells and boxes, vectorised."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.geometry import Piece

_MOST_CELLS = 1e6  # along one axis, so that the number of a cell fits 64 bits; coarser cells are only slower
MOST_PAIRS = 1_000_000
"""Number of pairs of circles after which the search ends; a scene with one pair is refused."""
_AT_ONCE = 4_000_000  # pairs of neighbours that are compared in one step: some 200 MB
# Half of a cell's neighbours: the other half sees the pair from its own side.
_FORWARD = ((0, 0), (1, -1), (1, 0), (1, 1), (0, 1))


def overlapping(
    centres: NDArray[np.float64], radii: NDArray[np.float64], tolerance: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs (i, j), i < j, of circles (centres (n, 2), radii (n,), m) that overlap by more than a tolerance (m).

    Pairs beyond about MOST_PAIRS are left out, because circles at one place have pairs by the square of their number.
    """
    if len(centres) < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    low = centres.min(axis=0)
    size = max(2 * float(radii.max()), float((centres.max(axis=0) - low).max()) / _MOST_CELLS)
    column, row = ((centres - low) / size).astype(np.int64).T
    stride = int(row.max()) + 3  # a free cell at either end of a column, so that neighbours never wrap around
    cell = column * stride + row + 1
    order = np.argsort(cell, kind="stable")
    ordered = cell[order]
    found, left = [], MOST_PAIRS
    for right, up in _FORWARD:
        wanted = ordered + right * stride + up
        begin = np.arange(len(cell)) + 1 if right == up == 0 else np.searchsorted(ordered, wanted, "left")
        end = np.searchsorted(ordered, wanted, "right")
        for first, last in _parts(end - begin):
            one, place = _ranges(begin[first:last], end[first:last])
            i, j = order[one + first], order[place]
            apart = np.hypot(*(centres[i] - centres[j]).T)
            close = apart < radii[i] + radii[j] - tolerance
            found.append(np.sort(np.column_stack([i[close], j[close]]), axis=1))
            left -= len(found[-1])
            if left <= 0:
                break
        if left <= 0:
            break
    pairs = np.vstack(found)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return pairs[:, 0], pairs[:, 1]


def near_pieces(
    points: NDArray[np.float64], pieces: Sequence[Piece], within: float
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.float64]]]:
    """Yield pieces that may be near points (n, 2): index of the piece, indices of points in order, distances (m).

    All points `within` (m) of a piece are included; others may be.
    """
    if not len(points) or not pieces:
        return
    order = np.argsort(points[:, 0], kind="stable")
    x = points[order, 0]
    boxes = np.array([piece.box for piece in pieces])
    # Twice the distance: a box's own rounding does not matter then.
    low, high = boxes[:, 0] - 2 * within, boxes[:, 1] + 2 * within
    begin, end = np.searchsorted(x, low[:, 0], "left"), np.searchsorted(x, high[:, 0], "right")
    for index in np.flatnonzero(begin < end).tolist():
        some = order[begin[index] : end[index]]
        y = points[some, 1]
        some = np.sort(some[(y >= low[index, 1]) & (y <= high[index, 1])])
        if len(some):
            yield index, some, pieces[index].distance(points[some])


def _parts(counts: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield parts [first, last) of a list whose counts come to about _AT_ONCE each, and at least one entry."""
    ends, first = np.cumsum(counts), 0
    while first < len(counts):
        before = int(ends[first - 1]) if first else 0
        last = max(first + 1, int(np.searchsorted(ends, before + _AT_ONCE, "right")))
        yield first, last
        first = last


def _ranges(begin: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all (k, place) with begin[k] <= place < end[k]."""
    count = end - begin
    one = np.repeat(np.arange(len(begin)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    return one, begin[one] + np.arange(len(one)) - first

# SPDX-License-Identifier: Apache-2.0
"""Repairs of drawn conveyors: duplicates left out, small gaps found and closed."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from conveyor_sim.page.drawings.chains import End, end_point
from conveyor_sim.page.drawings.entities import EntityRef, Stroke
from conveyor_sim.page.drawings.pieces import JOIN, DrawnPiece
from conveyor_sim.scene.types import XY

NOTICED: Final = 0.02
"""Largest gap (m) between ends that is reported."""
_SAME: Final = 1e-5  # m; curves whose points agree to this are one


@dataclass(frozen=True)
class Gap:
    """Two ends of strokes with no other end near them."""

    ends: tuple[End, End]
    sources: tuple[EntityRef, EntityRef]
    length: float
    """Distance of the ends (m)."""
    at: XY
    """Middle between the ends (m)."""


def distinct(strokes: Sequence[Stroke]) -> tuple[list[Stroke], list[tuple[Stroke, Stroke]]]:
    """Return the strokes without those drawn again, and each of those with the stroke that it repeats."""
    first: dict[object, Stroke] = {}
    repeated = []
    for stroke in strokes:
        forward = tuple(_key(piece) for piece in stroke.pieces)
        backward = tuple(_key(piece.reversed) for piece in reversed(stroke.pieces))
        original = first.setdefault((min(forward, backward), round(stroke.width / _SAME)), stroke)
        if original is not stroke:
            repeated.append((stroke, original))
    return list(first.values()), repeated


def _key(piece: DrawnPiece) -> tuple[int, ...]:
    return tuple(round(value / _SAME) for value in (*piece.start, *piece.end, piece.bulge))


def gaps(strokes: Sequence[Stroke], reach: float) -> list[Gap]:
    """Return the gaps longer than JOIN and at most `reach` (m), in the order of the strokes."""
    ends = [(number, last) for number, stroke in enumerate(strokes) if not stroke.is_closed for last in (False, True)]
    cells: dict[tuple[int, int], list[End]] = defaultdict(list)
    for end in ends:
        cells[_cell(end_point(strokes, end), reach)].append(end)
    near = {end: _near(strokes, end, cells, reach) for end in ends}
    found = []
    for end, others in near.items():
        if len(others) != 1 or near[others[0]] != [end] or others[0] < end or others[0][0] == end[0]:
            continue
        one, two = end_point(strokes, end), end_point(strokes, others[0])
        if (length := math.dist(one, two)) > JOIN:
            sources = strokes[end[0]].source, strokes[others[0][0]].source
            found.append(Gap((end, others[0]), sources, length, ((one[0] + two[0]) / 2, (one[1] + two[1]) / 2)))
    return found


def _cell(at: XY, reach: float) -> tuple[int, int]:
    return math.floor(at[0] / reach), math.floor(at[1] / reach)


def _near(strokes: Sequence[Stroke], end: End, cells: dict[tuple[int, int], list[End]], reach: float) -> list[End]:
    """Return the other ends within reach; at most two of them."""
    at = end_point(strokes, end)
    i, j = _cell(at, reach)
    found: list[End] = []
    for cell in ((i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)):
        for other in cells.get(cell, ()):
            if other != end and math.dist(at, end_point(strokes, other)) <= reach:
                found.append(other)
                if len(found) > 1:
                    return found
    return found


def close_gaps(strokes: Sequence[Stroke], found: Sequence[Gap]) -> None:
    """Move the ends of strokes together at gaps. Lines give way to arcs; two lines meet in the middle."""
    for gap in found:
        one, two = (_piece(strokes, end) for end in gap.ends)
        to = gap.at if bool(one.bulge) == bool(two.bulge) else end_point(strokes, gap.ends[0 if one.bulge else 1])
        for end in gap.ends:
            _move(strokes[end[0]], end[1], to)


def _piece(strokes: Sequence[Stroke], end: End) -> DrawnPiece:
    return strokes[end[0]].pieces[-1 if end[1] else 0]


def _move(stroke: Stroke, last: bool, to: XY) -> None:
    pieces = list(stroke.pieces)
    if last:
        pieces[-1] = replace(pieces[-1], end=to)
    else:
        pieces[0] = replace(pieces[0], start=to)
    stroke.pieces = tuple(pieces)

# SPDX-License-Identifier: Apache-2.0
"""Strokes of one layer joined end to end."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from conveyor_sim.page.drawings.entities import EntityRef, Stroke
from conveyor_sim.page.drawings.pieces import JOIN, SMOOTH, DrawnPiece, corner, reversed_curve
from conveyor_sim.scene.types import XY

End = tuple[int, bool]
"""End of a stroke: its number, and True for its last point."""


@dataclass
class Chain:
    """A curve of one or more strokes."""

    sources: list[EntityRef]
    pieces: list[DrawnPiece]
    name: str = ""
    width: float = 0.0
    is_closed: bool = False
    other_names: tuple[str, ...] = ()
    """Names of strokes that differ from `name`."""
    opposed: tuple[EntityRef, ...] = ()
    """Strokes that were drawn against the direction of the chain."""

    @property
    def source(self) -> EntityRef:
        """First entity of the chain."""
        return self.sources[0]


def joined(strokes: Sequence[Stroke], smooth: bool = False) -> list[Chain]:
    """Return the chains of strokes, in the order of the file. Ends within JOIN are joined if there are two of them.

    Strokes of different names or widths stay apart. smooth: only joints without a corner are joined. The direction of a
    chain is that of its first stroke with a direction.
    """
    partner = _partners(strokes, smooth)
    chains: list[Chain] = []
    used: set[int] = set()
    for index in range(len(strokes)):
        if index not in used:
            order = _ordered(index, strokes, partner)
            used.update(number for number, _ in order)
            chains.append(_chain(order, strokes, partner))
    return chains


def _partners(strokes: Sequence[Stroke], smooth: bool) -> dict[End, End]:
    cells: dict[tuple[int, int], list[End]] = defaultdict(list)
    ends = [(number, last) for number, stroke in enumerate(strokes) if not stroke.is_closed for last in (False, True)]
    for end in ends:
        cells[_cell(end_point(strokes, end))].append(end)
    near = {end: _neighbours(strokes, end, cells) for end in ends}
    pairs = {end: others[0] for end, others in near.items() if len(others) == 1 and near[others[0]] == [end]}
    return {end: other for end, other in pairs.items() if _fit(strokes, end, other, smooth)}


def _cell(at: XY) -> tuple[int, int]:
    return math.floor(at[0] / JOIN), math.floor(at[1] / JOIN)


def _neighbours(strokes: Sequence[Stroke], end: End, cells: Mapping[tuple[int, int], list[End]]) -> list[End]:
    """Return the other ends within JOIN; two of them if there are more, because these are not joined."""
    at = end_point(strokes, end)
    i, j = _cell(at)
    found: list[End] = []
    for cell in ((i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)):
        for other in cells.get(cell, ()):
            if other != end and math.dist(at, end_point(strokes, other)) <= JOIN:
                found.append(other)
                if len(found) > 1:
                    return found
    return found


def _fit(strokes: Sequence[Stroke], end: End, other: End, smooth: bool) -> bool:
    one, two = strokes[end[0]], strokes[other[0]]
    if one is two or (one.name and two.name and one.name != two.name):
        return one is two and not smooth
    if abs(one.width - two.width) > JOIN:
        return False
    return not smooth or abs(corner(_leading(one, end, True), _leading(two, other, False))) <= SMOOTH


def _leading(stroke: Stroke, end: End, to: bool) -> DrawnPiece:
    """Return the piece at an end of a stroke, drawn towards that end, or away from it."""
    piece = stroke.pieces[-1] if end[1] else stroke.pieces[0]
    return piece if end[1] == to else piece.reversed


def end_point(strokes: Sequence[Stroke], end: End) -> XY:
    """Return the point of an end."""
    pieces = strokes[end[0]].pieces
    return pieces[-1].end if end[1] else pieces[0].start


def _ordered(index: int, strokes: Sequence[Stroke], partner: dict[End, End]) -> list[tuple[int, bool]]:
    """Return the strokes of a chain with True for each that is drawn forward, and with the direction of the chain."""
    start: End = (index, False)
    while (before := partner.get(start)) is not None:
        start = before[0], not before[1]  # the other end of the stroke before
        if start[0] == index:
            break
    order = [(start[0], not start[1])]
    while (after := partner.get((order[-1][0], order[-1][1]))) is not None and after[0] != order[0][0]:
        order.append((after[0], not after[1]))
    first = min((number for number, _ in order if strokes[number].has_direction), default=None)
    if first is None:
        first = order[0][0]
    is_forward = dict(order)[first]
    return order if is_forward else [(number, not forward) for number, forward in reversed(order)]


def _chain(order: list[tuple[int, bool]], strokes: Sequence[Stroke], partner: dict[End, End]) -> Chain:
    curves = [strokes[n].pieces if forward else reversed_curve(strokes[n].pieces) for n, forward in order]
    parts = [strokes[number] for number, _ in order]
    against = tuple(s.source for s, (_, forward) in zip(parts, order, strict=True) if not forward and s.has_direction)
    names = list(dict.fromkeys(stroke.name for stroke in parts if stroke.name))
    is_closed = parts[0].is_closed or (len(order) > 1 and partner.get((order[-1][0], order[-1][1])) is not None)
    return Chain(
        [strokes[number].source for number in sorted(number for number, _ in order)],
        _met([list(curve) for curve in curves]),
        names[0] if names else "",
        max(stroke.width for stroke in parts),
        is_closed,
        tuple(names[1:]),
        against,
    )


def _met(curves: list[list[DrawnPiece]]) -> list[DrawnPiece]:
    """Return curves in a row as one, in which the pieces share their ends. Arcs keep their shape, lines give way."""
    for before, after in pairwise(curves):
        one, two = before[-1], after[0]
        if not one.bulge and not two.bulge:
            at = (one.end[0] + two.start[0]) / 2, (one.end[1] + two.start[1]) / 2
            before[-1], after[0] = replace(one, end=at), replace(two, start=at)
        elif not two.bulge:
            after[0] = replace(two, start=one.end)
        else:
            before[-1] = replace(one, end=two.start)
    return [piece for curve in curves for piece in curve]

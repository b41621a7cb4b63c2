# SPDX-License-Identifier: Apache-2.0
"""Paths of conveyors from drawn curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from conveyor_sim.page.drawings.numbers import degrees, number
from conveyor_sim.page.drawings.pieces import SMOOTH, DrawnPiece, corner, turned_by
from conveyor_sim.scene.types import TOUCH, XY

_ROUND = 1e-9  # m, rad


@dataclass
class DrawnPath:
    """A conveyor's path: start (m), heading (rad) and moves: (0, length) or (turn, radius)."""

    start: XY
    heading: float
    moves: list[tuple[float, float]]
    aside: float = 0.0
    """Distance (m) of its end from the drawn one."""

    def fields(self) -> dict[str, Any]:
        """Return the fields of a conveyor."""
        path = []
        for turn, size in self.moves:
            side = "left" if turn > 0 else "right"
            path.append({side: degrees(abs(turn)), "radius": number(size)} if turn else {"straight": number(size)})
        return {"start": [number(value) for value in self.start], "heading": degrees(self.heading), "path": path}


def path_of(pieces: Sequence[DrawnPiece], radius: float | None) -> DrawnPath | str:
    """Return the path of a curve, or the reason why there is none. radius: of bends at corners, m; None: none."""
    rounded = _rounded(pieces, radius)
    if isinstance(rounded, str):
        return rounded
    heading = _quarter(rounded[0].headings[0])
    path = DrawnPath(rounded[0].start, heading, [])
    at = path.start
    for piece in rounded:
        if piece.bulge:
            # The direction at its end is the drawn one, so that no error adds up.
            turn = piece.turn + turned_by(heading + piece.turn, piece.headings[1])
            turn, size = _quarter(turn), piece.radius
            left = math.copysign(size, turn)
            centre = at[0] - left * math.sin(heading), at[1] + left * math.cos(heading)
            heading += turn
            at = centre[0] + left * math.sin(heading), centre[1] - left * math.cos(heading)
        else:
            # A joint that is slightly off shortens or lengthens the piece, so that no error adds up.
            turn, cos, sin = 0.0, math.cos(heading), math.sin(heading)
            size = (piece.end[0] - at[0]) * cos + (piece.end[1] - at[1]) * sin
            if size <= TOUCH:
                continue
            at = at[0] + size * cos, at[1] + size * sin
        if path.moves and _continues(path.moves[-1], (turn, size)):
            before_turn, before_size = path.moves[-1]
            path.moves[-1] = (before_turn + turn, size) if turn else (0.0, before_size + size)
        else:
            path.moves.append((turn, size))
    path.aside = math.dist(at, rounded[-1].end)
    return path if path.moves else "it has no length"


def _continues(before: tuple[float, float], after: tuple[float, float]) -> bool:
    if before[0] == 0.0 or after[0] == 0.0:
        return before[0] == after[0]
    return before[0] * after[0] > 0.0 and abs(before[1] - after[1]) <= _ROUND * max(1.0, after[1])


def _rounded(pieces: Sequence[DrawnPiece], radius: float | None) -> list[DrawnPiece] | str:
    """Return a curve with bends in place of its corners, or the reason why that can't be."""
    result = [pieces[0]]
    for piece in pieces[1:]:
        before, turn = result[-1], corner(result[-1], piece)
        if abs(turn) <= SMOOTH:
            result.append(piece)
            continue
        where = f"a corner of {abs(math.degrees(turn)):.4g} deg at [{piece.start[0]:.4g}, {piece.start[1]:.4g}] (m)"
        if before.bulge or piece.bulge:
            return f"{where} next to an arc, expected arcs that continue their neighbours"
        if radius is None:
            return f"{where}, expected an arc there, or radius in the map"
        cut = radius * math.tan(abs(turn) / 2)
        if abs(turn) > math.pi - 1e-3 or cut > before.chord + TOUCH or cut > piece.chord + TOUCH:
            return f"{where} leaves no room for a bend with the radius {radius:g} m"
        first, last = _moved(before.end, before, -cut), _moved(piece.start, piece, cut)
        bend = [
            DrawnPiece(before.start, first),
            DrawnPiece(first, last, math.tan(turn / 4)),
            DrawnPiece(last, piece.end),
        ]
        result[-1:] = [part for part in bend if part.chord > TOUCH]
    return result


def _moved(point: XY, along: DrawnPiece, by: float) -> XY:
    share = by / along.chord
    return point[0] + share * (along.end[0] - along.start[0]), point[1] + share * (along.end[1] - along.start[1])


def _quarter(angle: float) -> float:
    """Return an angle, exact at multiples of a quarter turn."""
    angle = turned_by(0.0, angle) if abs(angle) > 2 * math.pi else angle
    exact = round(angle / (math.pi / 2)) * (math.pi / 2)
    return exact if abs(angle - exact) < _ROUND else angle

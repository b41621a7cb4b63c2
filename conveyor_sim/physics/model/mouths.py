"""Arcs of rail whose two ends can touch a bottle at once: each is cut in halves, for a piece touches at one point."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from conveyor_sim.physics.model.surfaces import JOINT_TOLERANCE
from conveyor_sim.scene.geometry import ArcPiece, Piece, RailShape, is_full_turn
from conveyor_sim.scene.overlaps import near_pieces


def cut_at_mouths(rails: Sequence[RailShape], radius: float) -> list[RailShape]:
    """The rails, with arcs like a C cut in halves if a bottle of a radius (m) can touch both their tips.

    The nearest point of a whole arc is one tip or the other, and the bottle would be pushed to one side. Rails with
    wider mouths, and arcs with both ends joined to other rails, stay as they are.
    """
    pieces = [piece for rail in rails for piece in rail.pieces]
    narrow = [place for place, piece in enumerate(pieces) if isinstance(piece, ArcPiece) and _is_narrow(piece, radius)]
    cut = _with_a_free_end(pieces, narrow)
    place, found = 0, []
    for rail in rails:
        parts = [_halves(piece) if place + n in cut else (piece,) for n, piece in enumerate(rail.pieces)]
        place += len(rail.pieces)
        found.append(replace(rail, pieces=tuple(half for part in parts for half in part)))
    return found


def _is_narrow(arc: ArcPiece, radius: float) -> bool:
    """Whether an axis beyond the arc's centre, as seen from the arc, can be within a radius (m) of both ends."""
    if is_full_turn(arc.span):
        return False
    return (arc.radius * math.sin(0.5 * arc.span) if arc.span > math.pi else arc.radius) < radius


def _with_a_free_end(pieces: Sequence[Piece], some: Sequence[int]) -> set[int]:
    """Which of some pieces have an end at which no other piece is."""
    ends = np.array([end for index in some for end in pieces[index].ends]).reshape(-1, 2)
    joined = np.zeros(len(ends), dtype=bool)
    for index, near, apart in near_pieces(ends, pieces, JOINT_TOLERANCE):
        own = np.array([some[end // 2] == index for end in near])
        joined[near[(apart <= JOINT_TOLERANCE) & ~own]] = True
    return {index for index, (first, last) in zip(some, joined.reshape(-1, 2), strict=True) if not (first and last)}


def _halves(piece: Piece) -> tuple[Piece, ...]:
    if not isinstance(piece, ArcPiece):
        return (piece,)
    half = 0.5 * piece.span
    return replace(piece, span=half), replace(piece, start_angle=piece.start_angle + half, span=piece.span - half)

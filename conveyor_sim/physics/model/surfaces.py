"""Surfaces of rail pieces: pieces that meet within JOINT_TOLERANCE at an end form one surface, in any order."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.rails.joint import ANSWERS, FREE, SILENT
from conveyor_sim.physics.plant import JOINT_TOLERANCE
from conveyor_sim.scene.geometry import Piece
from conveyor_sim.scene.overlaps import near_pieces, overlapping


@dataclass(frozen=True)
class Joints:
    """Joints at the ends of n rail pieces, (n, 2), start and end of each."""

    code: NDArray[np.int8]
    """FREE, ANSWERS or SILENT."""
    neighbour: NDArray[np.float64]
    """(n, 2, 2), unit vector from a joint into the neighbouring piece."""
    surface: NDArray[np.uint32]
    """(n,), equal for pieces of one surface."""


def find_joints(pieces: Sequence[Piece], inward: NDArray[np.float64]) -> Joints:
    """Join n rail pieces.

    inward: (n, 2, 2), unit vectors from each end into its piece. Where two ends meet, the first piece handles contacts
    of the point. Where more meet, or an end lies on another piece, ends stay free, and the shared push of a surface
    counts the point once.
    """
    ends = np.array([piece.ends for piece in pieces])
    code = np.full((len(pieces), 2), FREE, dtype=np.int8)
    neighbour = np.zeros((len(pieces), 2, 2))
    parent = list(range(len(pieces)))

    def root(piece: int) -> int:
        while parent[piece] != piece:
            piece = parent[piece]
        return piece

    def unite(piece: int, other: int) -> None:
        low, high = sorted((root(piece), root(other)))
        parent[high] = low

    for piece, other in _ends_on_pieces(pieces, ends):
        unite(piece, other)
    for meeting in _meeting_ends(ends):
        if len(meeting) == 2:
            (a, end_a), (b, end_b) = meeting
            code[a, end_a], code[b, end_b] = ANSWERS, SILENT
            neighbour[a, end_a] = inward[b, end_b]
            neighbour[b, end_b] = inward[a, end_a]
    surface = np.array([root(piece) for piece in range(len(pieces))], dtype=np.uint32)
    return Joints(code=code, neighbour=neighbour, surface=surface)


def _ends_on_pieces(pieces: Sequence[Piece], ends: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return pairs (piece, other) where an end of `other` lies on `piece`."""
    pairs: list[tuple[int, int]] = []
    for index, near, apart in near_pieces(ends.reshape(-1, 2), pieces, JOINT_TOLERANCE):
        touching = np.unique(near[apart <= JOINT_TOLERANCE] // 2)
        pairs.extend((index, other) for other in touching.tolist() if other != index)
    return pairs


def _meeting_ends(ends: NDArray[np.float64]) -> list[list[tuple[int, int]]]:
    """Return groups of two or more (piece, end) that share a point."""
    points = ends.reshape(-1, 2)
    near: dict[int, list[int]] = {}
    for one, other in zip(*overlapping(points, np.full(len(points), JOINT_TOLERANCE / 2), 0.0), strict=True):
        near.setdefault(int(one), []).append(int(other))
        near.setdefault(int(other), []).append(int(one))
    taken: set[int] = set()
    groups = []
    for index in sorted(near, key=lambda end: (points[end, 0], end)):
        if index in taken:
            continue
        group = [index, *(other for other in near[index] if other not in taken)]
        if len(group) > 1:
            taken.update(group)
            groups.append(sorted((flat // 2, flat % 2) for flat in group))
    return groups

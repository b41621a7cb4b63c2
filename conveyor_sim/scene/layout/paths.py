# SPDX-License-Identifier: Apache-2.0
"""Path of a conveyor in the file, as moves of a route: from its pieces, or from corners with a radius."""

import math
from collections.abc import Iterator
from itertools import pairwise

from conveyor_sim.scene.layout.faults import LayoutFault
from conveyor_sim.scene.layout.frames import PathFrame, turned
from conveyor_sim.scene.layout.parts import Move
from conveyor_sim.scene.layout.routes import Bend, Route, route_of
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.types import COORDINATE_LIMIT, XY
from conveyor_sim.scene.words import shown

SHORTEST = 1e-6
"""Shortest piece (m); shorter ones are within the tolerance of joints."""


def route_by_moves(start: PathFrame, moves: tuple[Move, ...], path: Path) -> Route:
    """Return the route of pieces from a frame. path: of the list. Raise LayoutFault."""
    route = route_of(start, [_move(move, (*path, index)) for index, move in enumerate(moves)])
    for index, piece in enumerate(route.pieces):
        within = [piece.end.xy, piece.centre] if isinstance(piece, Bend) else [piece.end.xy]
        for point in within:
            if not max(map(abs, point)) <= COORDINATE_LIMIT:
                text = f"{shown(moves[index].model_dump(exclude_none=True))} given, expected a piece that ends"
                raise LayoutFault((*path, index), f"{text} within +-{COORDINATE_LIMIT:.0f} (m)")
    return route


def _move(move: Move, path: Path) -> tuple[float, float]:
    sizes = {"straight": move.straight, "left": move.left, "right": move.right}
    given = {name: size for name, size in sizes.items() if size is not None}
    if len(given) != 1:
        raise LayoutFault(path, f"{', '.join(given) or 'no piece'} given, expected one of straight, left or right")
    ((kind, size),) = given.items()
    if kind == "straight":
        if move.radius is not None:
            raise LayoutFault((*path, "radius"), f"{shown(move.radius)} given, expected it only with left or right")
        length, turn_and_size = size, (0.0, size)
    else:
        if move.radius is None:
            raise LayoutFault((*path, "radius"), "missing, expected the radius of the middle of the bend (m)")
        length, turn_and_size = size * move.radius, (size if kind == "left" else -size, move.radius)
    if length < SHORTEST:
        raise LayoutFault((*path, kind), f"{shown(size)} given, expected a piece of at least {SHORTEST:g} m")
    return turn_and_size


def route_by_points(points: tuple[XY, ...], radius: float | None, path: Path) -> Route:
    """Return the route through corners (m), which are rounded by a radius (m). path: of the conveyor.

    Raise LayoutFault.
    """
    legs = [(math.atan2(dy, dx), length) for dx, dy, length in vectors(points, (*path, "points"))]
    turns = [turned(after[0], -before[0]) for before, after in pairwise(legs)]
    cuts = [0.0]
    for index, turn in enumerate(turns):
        if abs(turn) > math.pi - 1e-6:
            raise LayoutFault(
                (*path, "points", index + 1),
                f"{shown(points[index + 1])} given, expected a path that doesn't turn back",
            )
        if abs(turn) > 0.0 and radius is None:
            raise LayoutFault((*path, "radius"), "missing, expected the radius of the bends at the corners (m)")
        cuts.append(math.tan(0.5 * abs(turn)) * (radius or 0.0))
    cuts.append(0.0)
    moves = []
    for index, (_, length) in enumerate(legs):
        rest = length - cuts[index] - cuts[index + 1]
        if rest < -SHORTEST:
            most = (radius or 0.0) * length / (cuts[index] + cuts[index + 1])
            raise LayoutFault(
                (*path, "radius"),
                f"{shown(radius)} given, expected at most {most:.6g} (m), so that the bends fit between "
                f"points[{index}] and points[{index + 1}]",
            )
        if rest >= SHORTEST:
            moves.append((0.0, rest))
        if index < len(turns) and turns[index] != 0.0 and radius is not None:
            if abs(turns[index]) * radius < SHORTEST:
                raise LayoutFault(
                    (*path, "points", index + 1),
                    f"{shown(points[index + 1])} given, expected a bend of at least {SHORTEST:g} m, or none",
                )
            moves.append((turns[index], radius))
    return route_of(PathFrame(*points[0], legs[0][0]), moves)


def vectors(points: tuple[XY, ...], path: Path) -> Iterator[tuple[float, float, float]]:
    """Yield the vector and its length (m) from each point to the next. path: of the points.

    Raise LayoutFault for coinciding points.
    """
    for index, (before, after) in enumerate(pairwise(points)):
        dx, dy = after[0] - before[0], after[1] - before[1]
        length = math.sqrt(dx * dx + dy * dy)
        if length < SHORTEST:
            text = f"{shown(after)} given, expected a point away from the one before it (zero length)"
            raise LayoutFault((*path, index + 1), text)
        yield dx, dy, length

# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a conveyor: data of belts and plates for pieces of its path."""

import math
from typing import Any

from conveyor_sim.scene.layout.frames import turned
from conveyor_sim.scene.layout.routes import Bend, PathPiece, Straight

_QUARTER = 0.5 * math.pi


def surface(piece: PathPiece, right: float, width: float) -> dict[str, Any]:
    """Return the geometry of a strip along a piece, from an offset (m, positive to the left) to the left of it."""
    if isinstance(piece, Straight):
        return {
            "kind": "straight",
            "start": list(piece.start.point(0.0, right)),
            "angle": piece.start.angle,
            "length": piece.length,
            "width": width,
        }
    inner_radius = piece.radius - (right + width) if piece.turn > 0.0 else piece.radius + right
    data = {
        "kind": "curved",
        "centre": list(piece.centre),
        "inner_radius": max(0.0, inner_radius),
        **sector(piece),
        "width": width,
    }
    return data if piece.turn > 0.0 else {**data, "turn": "right"}


def sector(bend: Bend) -> dict[str, float]:
    """Return where a bend begins, seen from its centre, and its angle (rad), counter-clockwise."""
    begin = turned(bend.start.angle, -_QUARTER) if bend.turn > 0.0 else turned(bend.end.angle, _QUARTER)
    return {"start_angle": begin, "span": abs(bend.turn)}

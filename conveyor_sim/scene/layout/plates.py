"""Plates that fill the gap between two conveyors."""

from collections.abc import Iterator
from typing import Any

from conveyor_sim.scene.layout.parts import Conveyor
from conveyor_sim.scene.layout.plan import ConveyorPlan
from conveyor_sim.scene.layout.routes import Bend, PathPiece, Route, Straight
from conveyor_sim.scene.layout.surfaces import surface
from conveyor_sim.scene.types import TOUCH


def plates_of(conveyor: Conveyor, plan: ConveyorPlan, other: ConveyorPlan) -> Iterator[dict[str, Any]]:
    """Yield the geometry of the plates in the gap between a conveyor and the one that it is placed by."""
    gap = conveyor.gap or 0.0
    if conveyor.after is not None:
        yield _before(gap, conveyor.offset or 0.0, plan, other)
        return
    start = conveyor.from_ or 0.0
    right = other.edges[1] if conveyor.side == "left" else other.edges[0] - gap
    if start < other.route.length - TOUCH:
        for piece in _parallel(other.route.between(start, other.route.length), plan.route):
            yield surface(piece, right, gap)


def _before(gap: float, offset: float, plan: ConveyorPlan, other: ConveyorPlan) -> dict[str, Any]:
    """Return the plate in front of a conveyor, as wide as both conveyors together."""
    right = min(other.edges[0], plan.edges[0] + offset)
    left = max(other.edges[1], plan.edges[1] + offset)
    return surface(Straight.of(other.route.end, gap), right, left - right)


def _parallel(route: Route, other: Route) -> Iterator[PathPiece]:
    """Yield the pieces of a route along which another one, which begins beside it, keeps its distance."""
    for piece, beside in zip(route.pieces, other.pieces, strict=False):
        if isinstance(piece, Bend) and isinstance(beside, Bend):
            same = max(abs(a - b) for a, b in zip(piece.centre, beside.centre, strict=True)) <= TOUCH
            if not same or piece.turn * beside.turn < 0.0:
                return
            share, ratio = min(1.0, beside.turn / piece.turn), beside.turn / piece.turn
        elif isinstance(piece, Straight) and isinstance(beside, Straight):
            share, ratio = min(1.0, beside.length / piece.length), beside.length / piece.length
        else:
            return
        yield piece if share == 1.0 else piece.between(0.0, share * piece.length)
        if abs(ratio - 1.0) * piece.length > TOUCH:
            return

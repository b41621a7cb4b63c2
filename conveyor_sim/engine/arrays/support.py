"""What bottles stand on: belts, floor, the base."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.lists import Listed
from conveyor_sim.engine.arrays.types import F8, I1, I4, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Sectors(NamedTuple):
    """The curved ones among the belts, (H,)."""

    x: F8
    y: F8
    inner: F8
    outer: F8
    start_x: F8
    start_y: F8
    end_x: F8
    end_y: F8
    reach: I1
    """As in Arcs; -1 for a straight belt."""


@group
class Belts(NamedTuple):
    """Where belts lie, (H,), and which bottle stands on which, (S,)."""

    x: F8
    """Corner P1 of a straight belt."""
    y: F8
    ax: F8
    """Unit vector along it."""
    ay: F8
    length: F8
    width: F8
    sectors: Sectors | None
    certain: I4
    """(S,), the belt that carries wherever the bottle moves within the skin, -1: test the candidates."""
    start: U4
    candidate: U4
    """Belts that may carry, the last listed first; those of slot s are candidate[start[s]:start[s + 1]]."""
    uncertain: Listed


@group
class Surface(NamedTuple):
    """Velocity field of each belt's surface, (H + 1,): (ux - turn y, uy + turn x); the floor rests."""

    ux: F8
    uy: F8
    turn: F8 | None
    """rad/s; absent without curved belts."""
    friction: F8
    """(H + 1, T), coefficient by bottle type."""


@group
class Footing(NamedTuple):
    """What each bottle stands on, (S,): the field of its belt, copied so that the friction loop gathers nothing."""

    carrier: I4
    """The belt, or H, the floor."""
    ux: F8
    uy: F8
    turn: F8 | None
    friction_limit: F8
    """mu m g, N; 0 where a ring may straddle belts and is summed point by point."""


@group
class Ring(NamedTuple):
    """Base rings, (S,)."""

    radius: F8
    """R_b, m."""


@group
class StaticFriction(NamedTuple):
    """Springs between bases and belts (`static_friction.py`)."""

    x: F8
    """(S,), m, the point of the belt's surface that a base is tied to."""
    y: F8
    belt: I4
    """(S,), the belt of that point, or H, the floor; -1: none."""
    stiffness: F8
    """(H + 1) T, N/m, by belt and bottle type; 0 where friction goes by its curve, as damping and friction are then."""
    damping: F8
    """kg/s, likewise."""
    friction: F8
    """Likewise."""
    types: int
    """T."""

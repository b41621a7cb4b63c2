# SPDX-License-Identifier: Apache-2.0
"""Arrays of belts, floor and bases."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.lists import BottleList
from conveyor_sim.engine.arrays.types import F8, I1, I4, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Sectors(NamedTuple):
    """Curved belts, (H,)."""

    x: F8
    y: F8
    inner: F8
    outer: F8
    start_x: F8
    start_y: F8
    end_x: F8
    end_y: F8
    reach: I1
    """Reach as in Arcs; -1 for a straight belt."""


@group
class Belts(NamedTuple):
    """Geometry of belts, (H,), and the belts under each bottle, (S,)."""

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
    """Belt that carries the bottle wherever it moves within the skin, (S,); -1: test the candidates."""
    start: U4
    candidate: U4
    """Belts that may carry, the last listed first; slot s has candidate[start[s]:start[s + 1]]."""
    uncertain: BottleList


@group
class Surface(NamedTuple):
    """Velocity field of each belt's surface, (H + 1,): (ux - turn y, uy + turn x); the floor rests."""

    ux: F8
    uy: F8
    turn: F8 | None
    """rad/s; absent without curved belts."""
    friction: F8
    """Friction coefficient by bottle type, (H + 1, T)."""


@group
class Vibration(NamedTuple):
    """Vibration of surfaces (`vibration.py`), (H + 1,)."""

    ux: F8
    """Velocity field without vibration, as in `Surface`."""
    uy: F8
    turn: F8 | None
    """rad/s; absent without curved belts."""
    swing_x: F8
    """Amplitude of the velocity field."""
    swing_y: F8
    swing_turn: F8 | None
    frequency: F8
    """Hz; 0 for a surface that does not vibrate."""
    phase: F8
    """Phase at the start of the tick, rad."""
    ahead: F8
    """Mean of the cosine over the coming step, minus its present value."""
    clock: F8
    """Steps since the tick began, (1,)."""


@group
class Footing(NamedTuple):
    """Velocity field under each bottle, (S,): a copy of its belt's, so that the friction loop gathers nothing."""

    carrier: I4
    """Belt, or H for the floor."""
    ux: F8
    uy: F8
    turn: F8 | None
    friction_limit: F8
    """mu m g, N; 0 if a ring may straddle belts and is summed point by point."""


@group
class Ring(NamedTuple):
    """Base rings, (S,)."""

    radius: F8
    """R_b, m."""


@group
class StaticFriction(NamedTuple):
    """Springs between bases and belts (`static_friction.py`)."""

    x: F8
    """Point of the belt's surface to which a base is tied, m, (S,)."""
    y: F8
    belt: I4
    """Belt of that point, or H for the floor; -1: none, (S,)."""
    stiffness: F8
    """Stiffness by belt and bottle type, N/m, ((H + 1) T,). 0 without a spring; damping and friction are 0 then, too.
    """
    damping: F8
    """Damping by belt and bottle type, kg/s."""
    friction: F8
    """Friction coefficient by belt and bottle type."""
    types: int
    """Number of bottle types T."""

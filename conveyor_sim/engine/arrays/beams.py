# SPDX-License-Identifier: Apache-2.0
"""Arrays of `sensors/beams.py`: motion of bottles in a tick, beams, and when these are blocked. N slots, B beams."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.lists import StaticGrid
from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.groups import group


@group
class BottleMotion(NamedTuple):
    """Motion of bottles in a tick, (N,)."""

    start: F8
    """x, y, vx, vy at the start of the tick, m and m/s, (4, N)."""
    x: F8
    """x at the end of the tick, as are all fields below."""
    y: F8
    vx: F8
    vy: F8
    radius: F8
    id: I8


@group
class LightBeams(NamedTuple):
    """Beams, and the times in a tick at which bottles block them."""

    line: F8
    """Start, lower corner, upper corner, direction (m) and length (m) of each beam, (B, 9)."""
    grid: StaticGrid
    """Cells with the beams within `sensors.beams.REACH` of a point in them, as bodies."""
    near: I8
    """Scratch, (2, n)."""
    spans: F8
    """Times of each beam's blocked intervals, s from the start of the tick, in order and disjoint, (B, m, 2)."""
    used: I8
    """Number of intervals of each beam, (B,)."""
    state: I8
    """FREE, BLOCKED or CHANGES, (B,)."""

"""What `sensors/beams.py` needs to know of bottles and beams, and what it finds out. N slots, B beams."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.engine.compiler.groups import group


@group
class Ways(NamedTuple):
    """Where bottles begin and end a tick, and how fast, (N,)."""

    start: F8
    """(4, N), x, y, vx, vy at its begin, m and m/s."""
    x: F8
    """At its end, as all that follows."""
    y: F8
    vx: F8
    vy: F8
    radius: F8
    id: I8


@group
class LightBeams(NamedTuple):
    """Beams, and when in a tick bottles blocked them."""

    line: F8
    """(B, 9), of each its start, lower and upper corner, direction, m, and length, m."""
    near: I8
    """(2, n), scratch."""
    spans: F8
    """(B, m, 2), s from the begin of the tick, in order; those that meet are one."""
    used: I8
    """(B,), spans of each."""
    state: I8
    """(B,), FREE, BLOCKED or CHANGES."""

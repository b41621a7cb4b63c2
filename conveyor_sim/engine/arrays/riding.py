# SPDX-License-Identifier: Apache-2.0
"""Arrays of riding bottles (`riding.py`); None if no bottle can ride."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I1, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Riding(NamedTuple):
    """Runs of stepped bottles, by block (`workers.py`); bottles between them ride. Scratch of one call.

    Shapes: S bottle slots.
    """

    vx: F8
    """Velocities before the step under examination, m/s, (S,)."""
    vy: F8
    omega: F8 | None
    """Angular velocity before that step, rad/s, (S,); absent if nothing turns."""
    rides: I1
    """1: nothing changes the bottle's velocity until the next rebuild, (S,)."""
    first: U4
    """Starts of the runs, (S / LEAST + 2,). A block with first slot s stores its runs from index s / LEAST on."""
    end: U4
    """Ends of the runs, stored likewise."""
    runs: I8
    """Number of runs of a block, at the unit with which it starts, (S / UNIT + 1,)."""
    progress: I8
    """State of a block, stored likewise: all bottles are stepped, are examined, or may ride."""

"""Which bottles ride (`riding.py`); None where no bottle can."""

from typing import NamedTuple

from conveyor_sim.engine.arrays.types import F8, I1, I8, U4
from conveyor_sim.engine.compiler.groups import group


@group
class Riding(NamedTuple):
    """Runs of bottles that are stepped, block by block (`workers.py`); those between them ride. Scratch of one call.

    Shapes: S bottle slots.
    """

    vx: F8
    """(S,), m/s, velocities before the step that is looked at."""
    vy: F8
    omega: F8 | None
    """(S,), rad/s, likewise; absent where nothing turns."""
    rides: I1
    """(S,), 1: nothing changes its velocity until lists are made anew."""
    first: U4
    """(S / LEAST + 2,), where the runs begin; those of the block that begins with slot s from s / LEAST on."""
    end: U4
    """Where these runs end, likewise."""
    runs: I8
    """(S / UNIT + 1,), how many runs a block has, at the unit that it begins with."""
    progress: I8
    """Likewise: whether all its bottles are stepped, are looked at, or may ride."""

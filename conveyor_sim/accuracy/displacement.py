"""Displaces the bottles of a Simulation: for studies of how a disturbance grows."""

import numpy as np

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.simulation import Simulation


def displace(simulation: Simulation, dx: F8, dy: F8, dvx: F8 | None = None, dvy: F8 | None = None) -> None:
    """Move every bottle by (dx, dy) m and change its velocity by (dvx, dvy) m/s; (bottles,), in order of the ids.

    ValueError if the shapes do not match.
    """
    with simulation.editing() as (bottles, slots):
        changes = [(bottles.x, dx), (bottles.y, dy), (bottles.vx, dvx), (bottles.vy, dvy)]
        for _, change in changes:
            if change is not None and np.shape(change) != slots.shape:
                raise ValueError(f"a displacement of shape {np.shape(change)}, expected {slots.shape}")
        for column, change in changes:
            if change is not None:
                column[slots] += change

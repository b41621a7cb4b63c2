"""One number for what is seen of a state at a tick."""

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.state.state import State

COLUMNS = ("id", "type", "x", "y", "theta", "vx", "vy", "omega")
"""Of the bottles on the line, by id."""


def state_hash(tick: int, columns: Iterable[NDArray[Any]], state: State) -> int:
    """64 bits over a tick, columns, tangential springs that are not slack, and the places and speeds of moving rails.

    A Simulation gives COLUMNS, and setpoints and speeds of belts. Recordings hold this hash, so it stays as it is. It
    does not cover what else decides the next ticks: memories of devices and random streams, commands that wait, bottles
    that machines hold, the next id, neighbour lists, contact laws, courses and drives of moving rails, histories of
    impacts. `full_state_hash` does.
    """
    digest = hashlib.blake2b(np.int64(tick).tobytes(), digest_size=8)
    for column in columns:
        digest.update(column.tobytes())
    digest.update(state.springs())
    if (moving := state.world.moving) is not None:
        digest.update(moving.position.tobytes() + moving.speed.tobytes())
    return int.from_bytes(digest.digest(), "little")

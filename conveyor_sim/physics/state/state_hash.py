"""Hash of the visible part of a state at a tick."""

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.physics.state.state import State

COLUMNS = ("id", "type", "x", "y", "theta", "vx", "vy", "omega")
"""Columns of the bottles on the line, ordered by id."""


def state_hash(tick: int, columns: Iterable[NDArray[Any]], state: State) -> int:
    """Return 64 bits over a tick, columns, tangential springs that are not slack, and positions and speeds of rails.

    A Simulation passes COLUMNS, and setpoints and speeds of belts. Recordings contain this hash, so its definition must
    not change. Other state also decides the next ticks, and only `full_state_hash` covers it: memories of devices and
    random streams, waiting commands, bottles that machines hold, the next id, neighbour lists and contact laws. The
    same holds for motion profiles and drives of moving rails, and for histories of impacts.
    """
    digest = hashlib.blake2b(np.int64(tick).tobytes(), digest_size=8)
    for column in columns:
        digest.update(column.tobytes())
    digest.update(state.springs())
    if (moving := state.world.moving) is not None:
        digest.update(moving.position.tobytes() + moving.speed.tobytes())
    return int.from_bytes(digest.digest(), "little")

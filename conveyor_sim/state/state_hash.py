"""One number for the state at a tick."""

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.state.state import State


def state_hash(tick: int, columns: Iterable[NDArray[Any]], state: State) -> int:
    """64 bits over a tick, columns, tangential springs and moving rails."""
    digest = hashlib.blake2b(np.int64(tick).tobytes(), digest_size=8)
    for column in columns:
        digest.update(column.tobytes())
    digest.update(state.springs())
    if (moving := state.world.moving) is not None:
        digest.update(moving.position.tobytes() + moving.speed.tobytes())
    return int.from_bytes(digest.digest(), "little")

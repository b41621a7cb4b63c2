# SPDX-License-Identifier: Apache-2.0
"""Hashes of a state at a tick: of its visible part, and of everything that decides how a run continues.

The latter is the content of a checkpoint without observers. Its list is that of the checkpoint (`changing_arrays` and
the memory beside them), so new state is covered unless it is named here. `test/physics/state/test_full_state_hash.py`
changes each of its parts.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.physics.state.state import State
from conveyor_sim.physics.state.world_arrays import FIXED, LIMITED, OBSERVERS, SCRATCH, Arrays
from conveyor_sim.scene.limits import Limits

MEMORY: Mapping[tuple[str, ...], str] = {
    ("account",): "energy ledger",
    ("damage", "events"): "waits until it is taken",
    ("clogging", "events"): "waits until it is taken",
    ("integration", "events"): "waits until it is taken",
    ("integration", "deepest"): "largest overlap so far: only determines which report is the first",
    ("integration", "shortened_ticks"): "a count",
    ("line", "outcomes"): "wait until they are taken",
}
"""Parts of a run's memory that do not act on the line, by path."""


def full_state_hash(memory: Mapping[str, Any], arrays: Arrays, limits: Limits) -> int:
    """Return 64 bits over memory and arrays as a checkpoint holds them. Equal hashes mean equal futures, almost surely.

    The hash covers the motion: tick, ids, slots, bottles (also in machines), tangential springs (also stored ones),
    contact laws by pair, neighbour lists, moving rails with their drives, loads that have a limit.
    It covers the line: devices, random streams, waiting commands, modes, forces, alarms, counters, log.
    Not covered: SCRATCH, OBSERVERS, MEMORY, FIXED (arrays that the scene sets once); without limits of loads, LIMITED.

    A future belongs to one scene, version and sequence of commands. The memory of a controller is not part of a
    Simulation. Equal futures may have unequal hashes, because lists are hashed with their unused room.

    Cost: 0.2 to 0.3 ms for 9 to 95 bottles, most of it JSON of the line's memory (docs/performance/kernels.md).
    """
    decides = any(getattr(limits, name) is not None for name in Limits.model_fields if name != "clogging_time")
    left_out = (*FIXED, *SCRATCH, *OBSERVERS, *(() if decides else LIMITED))
    digest = hashlib.blake2b(_memory(memory, decides).encode(), digest_size=8)
    for name in sorted(arrays):
        if not name.startswith(left_out):
            array = arrays[name]
            digest.update(f"\0{name} {array.dtype.str} {array.shape}\0".encode())
            digest.update(array.tobytes())
    return int.from_bytes(digest.digest(), "little")


def _memory(memory: Mapping[str, Any], decides: bool) -> str:
    """Return the memory without MEMORY as JSON. The loads of held bottles stay if a limit depends on them."""
    kept: dict[str, Any] = dict(memory)
    for path in MEMORY:
        if len(path) == 1:
            kept.pop(path[0], None)
        elif isinstance(kept.get(path[0]), dict):
            kept[path[0]] = {name: part for name, part in kept[path[0]].items() if name != path[1]}
    if not decides:
        kept["held"] = [(bottle, tuple(one)[:2]) for bottle, one in kept["held"]]
    return json.dumps(kept)


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

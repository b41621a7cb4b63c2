"""One number for everything that decides how a run continues: the content of a checkpoint without observers.

The list is that of the checkpoint (`changing_arrays` and the memory beside them), so new state is covered unless it is
named here. `test/physics/state/test_full_state_hash.py` changes each of its parts.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from conveyor_sim.physics.state.world_arrays import Arrays
from conveyor_sim.physics.state.world_checks import FIXED
from conveyor_sim.scene.limits import Limits

SCRATCH: Mapping[str, str] = {
    "bottles.packed": "positions and velocities side by side, copied before forces are summed",
    "spin.moment": "summed anew from zero",
    "load.": "summed anew from zero",
    "stage.": "of one step of velocity Verlet or Runge-Kutta",
    "path.": "of one step",
    "slopes.": "of one step of a Runge-Kutta method",
    "linear.": "of one step of the linearly implicit method",
    "riding.": "of one call of an integrator",
}
"""Prefixes of the names of arrays that are written before they are read, with their content."""

OBSERVERS: Mapping[str, str] = {
    "peaks.": "largest forces since the last output; only outputs read them",
    "ledger.": "energy ledger; only outputs read it",
    "damage.scuffing.bins.": "loads on rails; only outputs read them",
    "damage.crushing.": "largest loads in this tick, which begins at zero, and since the last output",
    "damage.impacts.speed.": "likewise",
    "damage.impacts.force.": "likewise",
    "damage.tipping.ratio.": "likewise",
    "damage.impacts.touched": "of one step",
    "damage.tipping.fx": "of one step",
    "damage.tipping.fy": "of one step",
    "damage.tipping.moment": "of one step",
}
"""Prefixes of the names of arrays that only outputs read."""

LIMITED: Mapping[str, str] = {"damage.": "loads on bottles; only limits of the scene make events and alarms of them"}
"""Prefixes of the names of arrays that only outputs read in a scene without limits of loads."""

MEMORY: Mapping[tuple[str, ...], str] = {
    ("account",): "energy ledger",
    ("damage", "events"): "waits until it is taken",
    ("clogging", "events"): "waits until it is taken",
    ("integration", "events"): "waits until it is taken",
    ("integration", "deepest"): "largest overlap so far: decides only if a report is the first",
    ("integration", "shortened_ticks"): "a count",
    ("line", "outcomes"): "wait until they are taken",
}
"""Parts of a run's memory that do not act on the line, by path."""


def full_state_hash(memory: Mapping[str, Any], arrays: Arrays, limits: Limits) -> int:
    """Return 64 bits over memory and arrays as a checkpoint holds them. Equal hashes mean equal futures, almost surely.

    Covered of motion: tick, ids, slots, bottles (also in machines), tangential springs (also stored ones), contact laws
    by pair, neighbour lists, moving rails with their drives, loads that have a limit.
    Covered of the line: devices, random streams, waiting commands, modes, forces, alarms, counters, log.
    Left out: SCRATCH, OBSERVERS, MEMORY, FIXED (arrays that the scene sets once), and LIMITED without limits of loads.

    A future belongs to one scene, version and sequence of commands. The memory of a controller is not part of a
    Simulation. Equal futures may have unequal hashes, because lists are hashed with their unused room.

    Cost: 0.2 to 0.3 ms for 9 to 95 bottles, most of it JSON of the line's memory (docs/performance.md).
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

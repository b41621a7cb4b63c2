"""Threads that take steps together: who does which block of the work, and where they wait for each other.

Every thread runs the same integrator on the same World with a Worker of its own. Pairs, and bottles, are shared out in
whole units, and each share is worked on block by block. No block reads what another writes in the same phase, and no
sum runs over blocks, so the bits do not depend on who did which.
"""

from typing import Any

import numba
import numpy as np
from numba.extending import intrinsic

from conveyor_sim.engine.arrays.contacts import Gathered
from conveyor_sim.engine.arrays.damage import empty_history
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8, U4
from conveyor_sim.engine.arrays.world import Worker
from conveyor_sim.engine.compiler.compile import part

UNIT = 64
"""Pairs, or bottles, that are never parted: few enough that shares are even, and no two threads write to one line."""

BLOCK = 8 * UNIT
"""Pairs, or bottles, at a time at the most: what a thread holds of them stays in the first cache."""

MOST_CONTACTS = 32
"""Of one bottle with rails at a time, the deepest ones; as many touch only in a pocket drawn as a fine polyline."""

# Places in `Worker.sync`, a cache line apart.
ARRIVED, TURN, MOVED = 0, 8, 16
SYNC_SIZE = 24

SPINS = 2000
"""Looks at the barrier before a thread offers its core to others: about 20 us."""


def workers(size: int) -> tuple[Worker, ...]:
    """Return `size` workers of one group."""
    sync, callees = np.zeros(SYNC_SIZE, np.int64), np.zeros(2, np.int64)
    return tuple(
        Worker(rank, size, sync, _gathered(), _rail_contacts(), empty_history(), callees) for rank in range(size)
    )


def _gathered() -> Gathered:
    return Gathered(np.zeros(4 * BLOCK), np.zeros(BLOCK), np.zeros(BLOCK), np.zeros(BLOCK), np.zeros(4 * BLOCK))


def _rail_contacts() -> RailContacts:
    def reals() -> F8:
        return np.zeros(MOST_CONTACTS)

    def whole() -> U4:
        return np.zeros(MOST_CONTACTS, np.uint32)

    return RailContacts(
        nx=reals(),
        ny=reals(),
        overlap=reals(),
        share=reals(),
        material=whole(),
        rail=whole(),
        surface=whole(),
        entry=np.zeros(MOST_CONTACTS, np.int64),
        solution=reals(),
    )


@part
def share(worker: Worker, count: int) -> tuple[int, int]:
    """This worker's share of `count` things: the first, and where it ends."""
    units = (count + UNIT - 1) // UNIT
    # What can't be shared is for the calling thread, rank 0, which is awake already.
    begin = (worker.rank * units + worker.size - 1) // worker.size
    stop = ((worker.rank + 1) * units + worker.size - 1) // worker.size
    return min(begin * UNIT, count), min(stop * UNIT, count)


@part
def units(first: int, end: int) -> tuple[int, int]:
    """The units of things first to end, which begin with a unit: the first, and where they end."""
    return first // UNIT, (end + UNIT - 1) // UNIT


@part
def wait_for_all(worker: Worker) -> None:
    """Return when all workers have called it; what they wrote before is then seen by all."""
    if worker.size == 1:
        return
    turn = _load(worker.sync, TURN)
    if _add(worker.sync, ARRIVED, 1) == worker.size - 1:
        _store(worker.sync, ARRIVED, 0)
        _store(worker.sync, TURN, turn + 1)
        return
    spins = 0
    while _load(worker.sync, TURN) == turn:
        spins += 1
        if spins > SPINS:
            _sched_yield()


@part
def raise_flag(worker: Worker, flag: int) -> None:
    """Set a flag that all see after the next `wait_for_all`."""
    _store(worker.sync, flag, 1)


@part
def lower_flag(worker: Worker, flag: int) -> None:
    """Clear a flag; by one worker, between two barriers."""
    _store(worker.sync, flag, 0)


@part
def flag_raised(worker: Worker, flag: int) -> bool:
    """Whether a flag is set."""
    return _load(worker.sync, flag) != 0


_sched_yield = numba.types.ExternalFunction("sched_yield", numba.types.int32())


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    return builder.gep(builder.extract_value(array, 0), [index])


def _load_atomic(typing: Any, array: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1])
        return builder.load_atomic(pointer, "seq_cst", 8)

    return numba.types.int64(array, numba.types.intp), generate


def _store_atomic(typing: Any, array: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1])
        builder.store_atomic(args[2], pointer, "seq_cst", 8)
        return context.get_dummy_value()

    return numba.types.void(array, numba.types.intp, numba.types.int64), generate


def _add_atomic(typing: Any, array: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1])
        return builder.atomic_rmw("add", pointer, args[2], "seq_cst")

    return numba.types.int64(array, numba.types.intp, numba.types.int64), generate


# Numba has no atomic access to arrays on a CPU; these three are what a barrier takes.
_load: Any = intrinsic(_load_atomic)
_store: Any = intrinsic(_store_atomic)
_add: Any = intrinsic(_add_atomic)

# SPDX-License-Identifier: Apache-2.0
"""Threads that take steps together: their shares of the work, and barriers.

Every thread runs the same integrator on the same World, with its own Worker. Pairs and bottles are shared out in
complete units, and each share is processed block by block. No block reads data that another writes in the same phase,
and no sum runs over blocks, so the bits do not depend on the threads.
"""

import numpy as np

from conveyor_sim.engine.arrays.contacts import Gathered
from conveyor_sim.engine.arrays.damage import empty_history
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.types import F8, U4
from conveyor_sim.engine.arrays.world import Worker
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.compiler.numba_internals.atomics import add_atomic, load_atomic, sched_yield, store_atomic

UNIT = 64
"""Pairs or bottles per unit: few enough for even shares, enough that no two threads write to one cache line."""

BLOCK = 8 * UNIT
"""Pairs or bottles that are processed at a time, at most: their scratch fits into the first-level cache."""

CHUNK = 2 * UNIT
"""Pairs that are processed at a time as impulses."""

COLUMNS = 36
"""Columns of such a chunk."""

MOST_CONTACTS = 32
"""Largest number of simultaneous rail contacts of one bottle; only the deepest act. A bottle touches more rail pieces
only in a pocket drawn as a fine polyline."""

# Indices in `Worker.sync`, one cache line apart.
ARRIVED, TURN, MOVED = 0, 8, 16
SYNC_SIZE = 24

SPINS = 2000
"""Polls of the barrier before a thread yields its core: about 20 us."""


def workers(size: int) -> tuple[Worker, ...]:
    """Return `size` workers of one group."""
    sync, callees = np.zeros(SYNC_SIZE, np.int64), np.zeros(2, np.int64)
    return tuple(
        Worker(
            rank,
            size,
            sync,
            _gathered(),
            _rail_contacts(),
            empty_history(),
            np.zeros(COLUMNS * CHUNK),
            np.zeros(CHUNK, np.int64),
            callees,
        )
        for rank in range(size)
    )


def _gathered() -> Gathered:
    return Gathered(
        np.zeros(4 * BLOCK), np.zeros(BLOCK), np.zeros(BLOCK), np.zeros(BLOCK), np.zeros(4 * BLOCK), np.zeros(4 * BLOCK)
    )


def _rail_contacts() -> RailContacts:
    def reals() -> F8:
        return np.zeros(MOST_CONTACTS)

    def indices() -> U4:
        return np.zeros(MOST_CONTACTS, np.uint32)

    return RailContacts(
        nx=reals(),
        ny=reals(),
        overlap=reals(),
        share=reals(),
        material=indices(),
        rail=indices(),
        surface=indices(),
        entry=np.zeros(MOST_CONTACTS, np.int64),
        solution=reals(),
    )


@part
def share(worker: Worker, count: int) -> tuple[int, int]:
    """Return this worker's share of `count` items: the first, and the one after the last."""
    units = (count + UNIT - 1) // UNIT
    # The remainder is for the calling thread, rank 0, which is already awake.
    begin = (worker.rank * units + worker.size - 1) // worker.size
    stop = ((worker.rank + 1) * units + worker.size - 1) // worker.size
    return min(begin * UNIT, count), min(stop * UNIT, count)


@part
def units(first: int, end: int) -> tuple[int, int]:
    """Return the units of items first to end, which start with a unit: the first, and the one after the last."""
    return first // UNIT, (end + UNIT - 1) // UNIT


@part
def wait_for_all(worker: Worker) -> None:
    """Return when all workers have called it. All then see what each wrote before."""
    if worker.size == 1:
        return
    turn = load_atomic(worker.sync, TURN)
    if add_atomic(worker.sync, ARRIVED, 1) == worker.size - 1:
        store_atomic(worker.sync, ARRIVED, 0)
        store_atomic(worker.sync, TURN, turn + 1)
        return
    spins = 0
    while load_atomic(worker.sync, TURN) == turn:
        spins += 1
        if spins > SPINS:
            sched_yield()


@part
def raise_flag(worker: Worker, flag: int) -> None:
    """Set a flag, which all see after the next `wait_for_all`."""
    store_atomic(worker.sync, flag, 1)


@part
def lower_flag(worker: Worker, flag: int) -> None:
    """Clear a flag. Only one worker may call it, between two barriers."""
    store_atomic(worker.sync, flag, 0)


@part
def flag_raised(worker: Worker, flag: int) -> bool:
    """Return True if a flag is set."""
    return load_atomic(worker.sync, flag) != 0

# SPDX-License-Identifier: Apache-2.0
"""Riding bottles: alone on a straight belt, with a velocity that a step leaves unchanged to the bit.

The forces on such a bottle depend on its velocity alone, and the next step leaves that unchanged again. So they need
not be evaluated, and a step only adds x += dt v. The bottle rides until the next rebuild. Until then the lists hold no
pair and no rail for it, moving rails included, and its belt is certain. Everything else that changes its motion happens
between ticks: speeds of belts, bottles that come or go, faults, edits. So all bottles are stepped at the start of each
call of an integrator and after each rebuild, and the step that follows is examined.

Riding changes no bit, so it is optional. The loops skip only LEAST or more riding bottles in adjacent slots, because
skipping fewer costs more than it saves. The other bottles of a block form runs of stepped bottles. Force and
velocities of a riding bottle keep the values of the last step, which each further step would write again.
"""

from typing import Any

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.riding import Riding
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.pairs import pack
from conveyor_sim.engine.threads.workers import BLOCK, UNIT, share, units, wait_for_all

LEAST = 8
"""Smallest number of adjacent riding bottles that is skipped; the number of doubles in one vector instruction."""

STEPPED, EXAMINED, PLANNED = 0, 1, 2
"""State of a block: all its bottles are stepped; its velocities are stored for comparison; riders are determined."""


@part
def step_all(riding: Any, bottles: Bottles, worker: Worker) -> None:
    """Mark all bottles of this worker as stepped."""
    if riding is None:
        return
    begin, stop = share(worker, bottles.x.size)
    for first in range(begin, stop, BLOCK):
        unit = first // UNIT
        riding.progress[unit] = STEPPED
        riding.runs[unit] = 1
        riding.first[first // LEAST] = first
        riding.end[first // LEAST] = min(first + BLOCK, stop)


@part
def wake_all(riding: Any, bottles: Bottles, worker: Worker) -> None:
    """Mark all bottles as stepped after a rebuild, and pack riders at their present positions. All are then packed."""
    if riding is None:
        return
    begin, stop = share(worker, bottles.x.size)
    pack(bottles, begin, stop)
    step_all(riding, bottles, worker)
    wait_for_all(worker)


@part
def stepped_runs(riding: Any, first: int) -> int:
    """Return the number of stepped runs in the block that starts with a slot."""
    if riding is None:
        return 1
    return int(riding.runs[first // UNIT])


@part
def stepped_run(riding: Any, first: int, end: int, run: int) -> tuple[int, int]:
    """Return the first slot of a stepped run, and the slot after its last. end: that of the block."""
    if riding is None:
        return first, end
    return int(riding.first[first // LEAST + run]), int(riding.end[first // LEAST + run])


def skipped_slots(riding: Riding | None, slots: int) -> NDArray[np.bool_]:
    """Return a mask of the slots that the next step skips, free ones included, with the blocks of a single thread."""
    rides = np.zeros(slots, np.bool_)
    if riding is None:
        return rides
    for first in range(0, slots, BLOCK):
        if riding.progress[first // UNIT] == PLANNED:
            rides[first : first + BLOCK] = True
            for run in range(first // LEAST, first // LEAST + int(riding.runs[first // UNIT])):
                rides[riding.first[run] : riding.end[run]] = False
    return rides


@part
def begin_examination(bottles: Bottles, spin: Any, riding: Any, first: int, end: int) -> None:
    """Store the velocities of a block before its kick, if this step is to be examined."""
    if riding is None:
        return
    if riding.progress[first // UNIT] != STEPPED:
        return
    riding.progress[first // UNIT] = EXAMINED
    for i in range(uint64(first), uint64(end)):
        riding.vx[i] = bottles.vx[i]
        riding.vy[i] = bottles.vy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            riding.omega[i] = spin.omega[i]


@part
def end_examination(world: World, stage: Any, first: int, end: int) -> None:
    """Determine the riders of a block after its kick, if this step is to be examined.

    stage: velocities within the step that must be unchanged, too, or None.
    """
    riding = world.riding
    if riding is None:
        return
    if riding.progress[first // UNIT] != EXAMINED:
        return
    riding.progress[first // UNIT] = PLANNED
    _find_steady(world, stage, riding, first, end)
    _find_railed(world.railed, riding, first, end)
    _plan(riding, first, end)


@part
def _find_steady(world: World, stage: Any, riding: Riding, first: int, end: int) -> None:
    """Mark bottles with an unchanged velocity, no pair, and a certain belt that does not turn."""
    bottles, spin, slots, belts, footing = world.bottles, world.spin, world.slots, world.belts, world.footing
    for i in range(uint64(first), uint64(end)):
        # NaN counts as changed.
        steady = riding.vx[i] == bottles.vx[i] and riding.vy[i] == bottles.vy[i]
        if stage is not None:
            steady = steady and riding.vx[i] == stage.vx[i] and riding.vy[i] == stage.vy[i]
        if spin is not None:
            steady = steady and riding.omega[i] == spin.omega[i]
            if stage is not None:
                steady = steady and riding.omega[i] == stage.omega[i]
        if slots is not None:
            steady = steady and slots.filled[i] == 0
        if belts is not None:
            steady = steady and belts.certain[i] >= 0
        if footing is not None:
            if footing.turn is not None:
                steady = steady and footing.turn[i] == 0.0
        riding.rides[i] = 1 if steady else 0


@part
def _find_railed(railed: Any, riding: Riding, first: int, end: int) -> None:
    if railed is None:
        return
    begin, stop = units(first, end)
    for place in range(railed.first[begin], railed.first[stop]):
        riding.rides[railed.bottle[place]] = 0


@part
def _plan(riding: Riding, first: int, end: int) -> None:
    """Divide a block into runs, which end at LEAST or more adjacent riders."""
    place = first // LEAST
    count, begin, i = 0, first, first
    while i < end:
        last = i
        while last < end and riding.rides[last] != 0:
            last += 1
        if last - i >= LEAST:
            if begin < i:
                riding.first[place + count] = begin
                riding.end[place + count] = i
                count += 1
            begin = last
        i = last + 1
    if begin < end:
        riding.first[place + count] = begin
        riding.end[place + count] = end
        count += 1
    riding.runs[first // UNIT] = count


@part
def ride(bottles: Bottles, spin: Any, riding: Any, dt: float, first: int, end: int) -> None:
    """Move the riding bottles of first to end by dt seconds, with the same additions as in a step."""
    if riding is None:
        return
    begin = first
    for run in range(stepped_runs(riding, first)):
        left, right = stepped_run(riding, first, end, run)
        _coast(bottles, spin, dt, begin, left)
        begin = right
    _coast(bottles, spin, dt, begin, end)


@part
def _coast(bottles: Bottles, spin: Any, dt: float, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        bottles.x[i] = bottles.x[i] + dt * bottles.vx[i]
        bottles.y[i] = bottles.y[i] + dt * bottles.vy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            spin.theta[i] += dt * spin.omega[i]

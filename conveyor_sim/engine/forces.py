# SPDX-License-Identifier: Apache-2.0
"""One evaluation of all forces: a function of positions, velocities and springs, for any integrator.

There are two phases with a barrier between them: `pair_phase` reads every bottle and writes pairs, `bottle_forces`
reads pairs and writes bottles, block by block. Sums run in a fixed order: pairs by partner,
segments, arcs, moving rails, base.
"""

from typing import Any

from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.pairs import find_touching, pack, pair_forces
from conveyor_sim.engine.contact.slots import sum_pair_forces, sum_slots
from conveyor_sim.engine.lists.riding import stepped_run, stepped_runs
from conveyor_sim.engine.observers.ledger_parts import (
    add_belt_powers,
    clear_belt_powers,
    find_base_parts,
    find_pair_parts,
    store_load,
    sum_pair_parts,
)
from conveyor_sim.engine.rails.rails import add_rail_forces, count_rail_contacts
from conveyor_sim.engine.support.base import add_base_friction, add_straddling_friction
from conveyor_sim.engine.support.footing import check_footing
from conveyor_sim.engine.support.static_friction import add_static_friction
from conveyor_sim.engine.threads.workers import BLOCK, share, wait_for_all


@part
def pack_all(world: World, worker: Worker) -> None:
    """Pack this worker's bottles; on return all are packed."""
    begin, stop = share(worker, world.bottles.x.size)
    pack(world.bottles, begin, stop)
    wait_for_all(worker)


@part
def pair_phase(world: World, worker: Worker, dt: float, spring_dt: float) -> None:
    """Compute the forces of this worker's share of the pairs; on return all pairs are done.

    All bottles must be packed. dt: step, s, for the implicit solver. spring_dt: s; tangential springs are elongated by
    spring_dt times the slip, or by `World.path` if it is not None. 0: elongations are not stored.
    """
    _count_closed(world, worker, dt)
    pair_forces(world, worker, spring_dt)
    find_pair_parts(world, worker)
    wait_for_all(worker)


@part
def bottle_forces(world: World, worker: Worker, dt: float, spring_dt: float, first: int, end: int) -> None:
    """Fill `world.load` (N) and `world.spin.moment` (N m) of bottles first to end (eq. 22), except riding ones.

    First to end is a block; riding bottles are skipped (`riding.py`).
    """
    lag = world.settings.lag * dt
    clear_belt_powers(world.ledger, first, end)
    for run in range(stepped_runs(world.riding, first)):
        begin, stop = stepped_run(world.riding, first, end, run)
        sum_pair_forces(world.pairs, world.slots, world.load, _moments(world.spin), begin, stop)
        sum_pair_parts(world.pairs, world.slots, world.ledger, begin, stop)
    # Bottles listed near rails or belt edges never ride, so no loop over runs is needed.
    add_rail_forces(world, worker.rail_contacts, first, end, spring_dt)
    check_footing(world.bottles, world.belts, world.surface, world.footing, world.ring, first, end)
    for run in range(stepped_runs(world.riding, first)):
        begin, stop = stepped_run(world.riding, first, end, run)
        store_load(world.load, world.spin, world.ledger, begin, stop)
        add_base_friction(world, world.spin, world.load, world.implicit, dt, spring_dt, begin, stop)
    add_straddling_friction(world, world.spin, world.load, _belt_power(world.ledger), lag, first, end)
    add_static_friction(world.bottles, world.load, world.footing, world.static_friction, lag, True, first, end)
    if world.ledger is not None:
        for run in range(stepped_runs(world.riding, first)):
            begin, stop = stepped_run(world.riding, first, end, run)
            find_base_parts(world, begin, stop)
        add_belt_powers(world, first, end)


@part
def _belt_power(ledger: Any) -> Any:
    if ledger is None:
        return None
    return ledger.belt_power


@part
def _moments(spin: Any) -> Any:
    if spin is None:
        return None
    return spin.moment


@part
def _count_closed(world: World, worker: Worker, dt: float) -> None:
    """Count the closed contacts of every bottle, for the mass splitting of the implicit solver."""
    bottles, implicit = world.bottles, world.implicit
    if implicit is None:
        return
    find_touching(world.settings, bottles, world.pairs, worker)
    wait_for_all(worker)
    begin, stop = share(worker, bottles.x.size)
    for first in range(begin, stop, BLOCK):
        end = min(first + BLOCK, stop)
        for run in range(stepped_runs(world.riding, first)):
            left, right = stepped_run(world.riding, first, end, run)
            sum_slots(world.slots, _touch(world), left, right, implicit.closed)
        count_rail_contacts(world, worker.rail_contacts, first, end, implicit.closed)
        for run in range(stepped_runs(world.riding, first)):
            left, right = stepped_run(world.riding, first, end, run)
            for i in range(left, right):
                # The base counts as one more closed contact.
                implicit.closed[i] += 1.0
                implicit.compliance[i] = world.settings.ahead * dt * implicit.mobility[i] * implicit.closed[i]
    wait_for_all(worker)


@part
def _touch(world: World) -> Any:
    if world.pairs is None:
        return None
    return world.pairs.touch

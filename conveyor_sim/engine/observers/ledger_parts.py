# SPDX-License-Identifier: Apache-2.0
"""Parts of the forces for the energy ledger (`ledger.py`): dissipation, and the work of belts, in an evaluation.

Three parts are stored beside the sum of forces on a bottle: damping in its contacts, friction in them, and the force of
the surface under it. Damping is everything along the normal except the elastic law, and isotropic damping across it.
Friction is the rest across, including tangential springs and their dashpots. Nothing here changes a force.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.integrators import Triple
from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.contact import drag_force, elastic_force
from conveyor_sim.engine.contact.pairs import normal_and_overlap
from conveyor_sim.engine.contact.slots import sum_slots
from conveyor_sim.engine.rails.deepest_contacts import law_entry, rail_arm
from conveyor_sim.engine.rails.moving import add_rail_power
from conveyor_sim.engine.threads.workers import UNIT, share, units


@part
def find_pair_parts(world: World, worker: Worker) -> None:
    """Divide the forces just computed for this worker's share of the pairs into parts, in `pairs.parts`."""
    bottles, spin, pairs = world.bottles, world.spin, world.pairs
    if world.ledger is None:
        return
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    count: Any = uint64(pairs.i.size)
    for p in range(uint64(begin), uint64(stop)):
        i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
        reach = bottles.radius[i] + bottles.radius[j]
        dx, dy = bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i]
        nx = ny = along = drag = across = arm_i = arm_j = 0.0
        if dx * dx + dy * dy < reach * reach:
            overlap, nx, ny = normal_and_overlap(dx, dy, reach)
            vx, vy = bottles.vx[i] - bottles.vx[j], bottles.vy[i] - bottles.vy[j]
            slip = vy * nx - vx * ny
            if spin is not None:
                shorter = 0.5 * world.settings.lever * overlap
                arm_i, arm_j = bottles.radius[i] - shorter, bottles.radius[j] - shorter
                slip += spin.omega[i] * arm_i + spin.omega[j] * arm_j
            elastic = elastic_force(pairs.law, p, world.curves, overlap)
            drag = drag_force(pairs.law, p, elastic, overlap, -slip)
            along = -(pairs.fx[p] * nx + pairs.fy[p] * ny) - elastic
            across = pairs.fy[p] * nx - pairs.fx[p] * ny - drag
        _write(pairs.parts.damping, p, count, along, drag, nx, ny, arm_i, arm_j)
        _write(pairs.parts.friction, p, count, 0.0, across, nx, ny, arm_i, arm_j)


@part
def _write(
    force: Triple,
    p: int,
    pairs: int,
    normal: float,
    tangential: float,
    nx: float,
    ny: float,
    arm_i: float,
    arm_j: float,
) -> None:
    q = p + pairs
    fx, fy = -normal * nx - tangential * ny, tangential * nx - normal * ny
    force.x[p] = fx
    force.y[p] = fy
    force.x[q] = -fx
    force.y[q] = -fy
    force.turn[p] = arm_i * tangential
    force.turn[q] = arm_j * tangential


@part
def sum_pair_parts(pairs: Any, slots: Any, ledger: Any, first: int, end: int) -> None:
    """Set the parts of bottles first to end to the sums over their pairs."""
    if ledger is None:
        return
    if pairs is None:
        _clear(ledger.damping, first, end)
        _clear(ledger.friction, first, end)
        return
    _sum(slots, pairs.parts.damping, ledger.damping, first, end)
    _sum(slots, pairs.parts.friction, ledger.friction, first, end)


@part
def _clear(force: Triple, first: int, end: int) -> None:
    for i in range(first, end):
        force.x[i] = force.y[i] = force.turn[i] = 0.0


@part
def _sum(slots: Any, by_pair: Triple, force: Triple, first: int, end: int) -> None:
    sum_slots(slots, by_pair.x, first, end, force.x)
    sum_slots(slots, by_pair.y, first, end, force.y)
    sum_slots(slots, by_pair.turn, first, end, force.turn)


@part
def add_rail_parts(
    world: World, contacts: RailContacts, c: int, i: int, normal: float, tangential: float, slip: float
) -> None:
    """Divide N and T (N) of contact c of bottle i with a rail into parts; slip in m/s."""
    ledger, law = world.ledger, world.rail_law
    if ledger is None:
        return
    nx, ny, overlap, shared = contacts.nx[c], contacts.ny[c], contacts.overlap[c], contacts.share[c]
    entry, arm = law_entry(world, contacts, c, i), rail_arm(overlap, world.bottles.radius[i], world.settings.lever)
    elastic = elastic_force(law, entry, world.curves, overlap)
    drag = shared * drag_force(law, entry, elastic, overlap, -slip)
    along = normal - shared * elastic
    across = tangential - drag
    damping, friction = ledger.damping, ledger.friction
    damping.x[i] += -along * nx - drag * ny
    damping.y[i] += drag * nx - along * ny
    damping.turn[i] += arm * drag
    friction.x[i] -= across * ny
    friction.y[i] += across * nx
    friction.turn[i] += arm * across
    add_rail_power(world, contacts, c, i, normal, tangential, along, drag, across)


@part
def clear_belt_powers(ledger: Any, first: int, end: int) -> None:
    """Reset the powers of belts on bottles first to end, which start with a unit."""
    if ledger is None:
        return
    begin, stop = units(first, end)
    for unit in range(begin, stop):
        for h in range(ledger.belt_power.shape[1]):
            ledger.belt_power[unit, h] = 0.0


@part
def store_load(load: ForceSums, spin: Any, ledger: Any, first: int, end: int) -> None:
    """Store the contact forces on bottles first to end, before base friction is added."""
    if ledger is None:
        return
    for i in range(uint64(first), uint64(end)):
        ledger.base.x[i] = load.fx[i]
        ledger.base.y[i] = load.fy[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            ledger.base.turn[i] = spin.moment[i]


@part
def find_base_parts(world: World, first: int, end: int) -> None:
    """Compute the part that base friction has added to the load of bottles first to end."""
    load, spin, ledger = world.load, world.spin, world.ledger
    if ledger is None:
        return
    base = ledger.base
    for i in range(uint64(first), uint64(end)):
        base.x[i] = load.fx[i] - base.x[i]
        base.y[i] = load.fy[i] - base.y[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            base.turn[i] = spin.moment[i] - base.turn[i]


@part
def add_belt_powers(world: World, first: int, end: int) -> None:
    """Add the power of each belt on bottles first to end; the base friction of riders is unchanged."""
    footing, ledger = world.footing, world.ledger
    if ledger is None:
        return
    if footing is not None:
        for i in range(uint64(first), uint64(end)):
            # A ring that may straddle belts is booked point by point.
            if not _by_points(world.belts, world.ring, i):
                power = _belt_power(world.bottles, footing, footing.turn, ledger.base, i)
                ledger.belt_power[i // uint64(UNIT), footing.carrier[i]] += power


@part
def _by_points(belts: Any, ring: Any, i: int) -> bool:
    if ring is None:
        return False
    if belts is None:
        return False
    return belts.certain[i] < 0 and ring.radius[i] > 0.0


@part
def _belt_power(bottles: Bottles, footing: Any, turn: Any, base: Triple, i: int) -> float:
    """Return F u + M Omega (W). A belt moves as a rigid body, so u at the axis and its rotation suffice."""
    ux, uy, moment = footing.ux[i], footing.uy[i], 0.0
    if turn is not None:
        ux -= turn[i] * bottles.y[i]
        uy += turn[i] * bottles.x[i]
        moment = base.turn[i] * turn[i]
    return base.x[i] * ux + base.y[i] * uy + moment

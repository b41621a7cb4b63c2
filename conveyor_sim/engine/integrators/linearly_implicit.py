# SPDX-License-Identifier: Apache-2.0
"""Linearly implicit: forces are linearised in the change of velocity, which a linear system determines.

    (M + theta^2 h^2 K + theta h C) dv = h F(r + theta h v, v),  r += h (v + theta dv),  v += dv     (`tangent.py`)

If a step resolves the stiffest contact, theta is 1/2, the implicit midpoint rule. Its order is 2 where forces are
smooth and through friction, and at first touch that of every method: 1 with a dashpot, clamped or not, 2 without, 2.5
in velocity with Hertz (RMS over 64 phases: 1.00, 1.00, 2.00, 2.52; through friction 2.00). In longer steps theta goes
to 1, implicit Euler, and the system is linearised at its solution and solved again, up to PASSES times, because
contacts close and open. Impacts within a step are then lost, but packings and queues stay stable and press with the
right forces, at any step.

A system is solved by conjugate gradients (`conjugate_gradients.py`).
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.integrators import Blocks, Linear
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.contact.slots import sum_pair_forces
from conveyor_sim.engine.forces import bottle_forces, pack_all, pair_phase
from conveyor_sim.engine.integrators.conjugate_gradients import (
    LEAST,
    RELATIVE,
    begin_search,
    factor,
    kick_with_rest,
    largest_kick,
    search,
)
from conveyor_sim.engine.integrators.motion import accumulate_peaks, lists_hold, probe_rebuilt, settle
from conveyor_sim.engine.integrators.tangent_base import resist_base
from conveyor_sim.engine.integrators.tangent_pairs import add_pair_blocks, linear_pairs, stiffest_pairs
from conveyor_sim.engine.integrators.tangent_rails import linear_rails, stiffest_rails
from conveyor_sim.engine.lists.rebuild import moved_too_far
from conveyor_sim.engine.observers.damage import note_damage
from conveyor_sim.engine.observers.ledger import book, note_powers
from conveyor_sim.engine.support.base import add_base_friction, add_straddling_friction
from conveyor_sim.engine.support.footing import check_footing
from conveyor_sim.engine.threads.workers import BLOCK, MOVED, UNIT, raise_flag, share, wait_for_all

PASSES = 10
"""Limit of passes in a step longer than a contact. The residual impulse is then applied, which conserves momentum."""

ENOUGH = 1e-4
"""Residual at which the system is assembled again, as a share of the largest initial kick."""


@kernel
def advance(world: World, worker: Worker, steps: int, dt: float, phase: int) -> int:
    """Take up to `steps` steps of dt seconds; return how many were taken (see the package's docstring)."""
    bottles = world.bottles
    linear: Any = world.linear
    begin, stop = share(worker, bottles.x.size)
    for step in range(steps):
        note_damage(world, worker, dt)
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            _begin(bottles, linear, first, end)
            _predict(world, dt, 0.0, first, end)
        squared = dt * dt * _stiffest(world, worker)
        theta = _theta_of(squared)
        small = enough = 0.0
        for again in range(PASSES if theta > 0.5 else 1):
            for first in range(begin, stop, BLOCK):
                _predict(world, theta * dt, theta, first, min(first + BLOCK, stop))
            wait_for_all(worker)
            linear_pairs(world, worker, (dt, theta), again)
            wait_for_all(worker)
            for first in range(begin, stop, BLOCK):
                _assemble(world, worker, dt, theta, first, min(first + BLOCK, stop))
            wait_for_all(worker)
            most = largest_kick(linear)
            if again == 0:
                small, enough = max(RELATIVE * most, LEAST), max(ENOUGH * most, LEAST * (1.0 + 10.0 * squared))
            elif not most > enough:
                break
            if search(world, worker, small):
                for first in range(begin, stop, BLOCK):
                    kick_with_rest(bottles, world.spin, linear, first, min(first + BLOCK, stop))
        for first in range(begin, stop, BLOCK):
            end = min(first + BLOCK, stop)
            _move(bottles, linear, dt, theta, first, end)
            _turn(world.spin, linear, dt, theta, first, end)
            accumulate_peaks(world.load, world.peaks, dt, first, end)
            # Half of the distance that other methods allow: contacts are evaluated ahead, by up to the other half.
            if moved_too_far(bottles, world.neighbourhood, 0.5 * world.settings.skin, first, end) or _fast(
                bottles, 0.25 * world.settings.skin / dt, first, end
            ):
                raise_flag(worker, MOVED)
        _book_solution(world, linear, world.ledger, worker, dt, theta)
        if not lists_hold(world, worker):
            return step + 1
        probe_rebuilt(world, worker)
    return steps


@part
def _begin(bottles: Bottles, linear: Linear, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        linear.x[i] = bottles.x[i]
        linear.y[i] = bottles.y[i]
        linear.change.x[i] = linear.change.y[i] = linear.change.turn[i] = 0.0


@part
def _predict(world: World, time: float, theta: float, first: int, end: int) -> None:
    """Move bottles to their predicted positions after some time (s), but no farther than the lists hold."""
    bottles: Bottles = world.bottles
    linear: Any = world.linear
    far = 0.25 * world.settings.skin
    for i in range(uint64(first), uint64(end)):
        vx, vy = bottles.vx[i] + theta * linear.change.x[i], bottles.vy[i] + theta * linear.change.y[i]
        distance = time * math.sqrt(vx * vx + vy * vy)
        allowed = max(far, time * math.sqrt(bottles.vx[i] * bottles.vx[i] + bottles.vy[i] * bottles.vy[i]))
        reached = time * (allowed / distance if distance > allowed else 1.0)
        bottles.x[i] = linear.x[i] + reached * vx
        bottles.y[i] = linear.y[i] + reached * vy


@part
def _fast(bottles: Bottles, limit: float, first: int, end: int) -> bool:
    far = 0
    for i in range(uint64(first), uint64(end)):
        far |= bottles.vx[i] * bottles.vx[i] + bottles.vy[i] * bottles.vy[i] > limit * limit
    return far != 0


@part
def _stiffest(world: World, worker: Worker) -> float:
    """Return the largest stiffness times mobility of all contacts, 1/s^2."""
    bottles: Bottles = world.bottles
    linear: Any = world.linear
    begin, stop = share(worker, bottles.x.size)
    wait_for_all(worker)
    stiffest_pairs(world, worker)
    for first in range(begin, stop, BLOCK):
        stiffest_rails(world, worker.rail_contacts, first, min(first + BLOCK, stop))
    wait_for_all(worker)
    most = _most_of_pairs(world.pairs)
    for unit in range(linear.most.size):
        most = linear.most[unit] if linear.most[unit] > most else most
    return most


@part
def _most_of_pairs(pairs: Any) -> float:
    most = 0.0
    if pairs is not None:
        for unit in range((pairs.used[0] + UNIT - 1) // UNIT):
            most = pairs.tangent.most[unit] if pairs.tangent.most[unit] > most else most
    return most


@part
def _theta_of(squared: float) -> float:
    """Return theta, the position in a step at which forces are evaluated, from (w dt)^2 of the stiffest contact."""
    squared = 1.0 if squared < 1.0 else squared
    return 1.0 - 0.5 / (squared * squared)


@part
def _assemble(world: World, worker: Worker, dt: float, theta: float, first: int, end: int) -> None:
    """Assemble blocks and right-hand side of bottles first to end, and begin the search."""
    bottles: Bottles = world.bottles
    linear: Any = world.linear
    own, inverse = linear.own, linear.inverse
    sum_pair_forces(world.pairs, world.slots, world.load, _moments(world.spin), first, end)
    _inertia(bottles, world.spin, own, first, end)
    linear_rails(world, worker.rail_contacts, (dt, theta), first, end)
    check_footing(bottles, world.belts, world.surface, world.footing, world.ring, first, end)
    add_base_friction(world, world.spin, world.load, None, dt, dt, first, end)
    add_straddling_friction(world, world.spin, world.load, None, world.settings.lag * dt, first, end)
    resist_base(world, dt, theta, first, end)
    _copy_blocks(own, inverse, first, end)
    add_pair_blocks(world.pairs, world.slots, inverse, first, end)
    factor(own, inverse, first, end)
    begin_search(bottles, world.spin, world.load, linear, dt, first, end)


@part
def _moments(spin: Any) -> Any:
    if spin is None:
        return None
    return spin.moment


@part
def _inertia(bottles: Bottles, spin: Any, own: Blocks, first: int, end: int) -> None:
    """Set blocks to inertia alone. Free slots, and bottles that can't turn, have 1, because nothing pushes them."""
    for i in range(uint64(first), uint64(end)):
        mass = 1.0 / bottles.inverse_mass[i] if bottles.inverse_mass[i] > 0.0 else 1.0
        own.xx[i] = own.yy[i] = mass
        own.xy[i] = own.xt[i] = own.yt[i] = 0.0
        own.tt[i] = 1.0
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            own.tt[i] = 1.0 / spin.inverse_inertia[i] if spin.inverse_inertia[i] > 0.0 else 1.0


@part
def _copy_blocks(source: Blocks, target: Blocks, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        target.xx[i] = source.xx[i]
        target.xy[i] = source.xy[i]
        target.yy[i] = source.yy[i]
        target.xt[i] = source.xt[i]
        target.yt[i] = source.yt[i]
        target.tt[i] = source.tt[i]


@part
def _move(bottles: Bottles, linear: Linear, dt: float, theta: float, first: int, end: int) -> None:
    change = linear.change
    for i in range(uint64(first), uint64(end)):
        bottles.x[i] = linear.x[i] + dt * (bottles.vx[i] + theta * change.x[i])
        bottles.y[i] = linear.y[i] + dt * (bottles.vy[i] + theta * change.y[i])
        bottles.vx[i] = settle(bottles.vx[i] + change.x[i])
        bottles.vy[i] = settle(bottles.vy[i] + change.y[i])


@part
def _turn(spin: Any, linear: Linear, dt: float, theta: float, first: int, end: int) -> None:
    if spin is None:
        return
    for i in range(uint64(first), uint64(end)):
        spin.theta[i] += dt * (spin.omega[i] + theta * linear.change.turn[i])
        spin.omega[i] = settle(spin.omega[i] + linear.change.turn[i])


@part
def _book_solution(world: World, linear: Linear, ledger: Any, worker: Worker, dt: float, theta: float) -> None:
    """Book a step with the contact laws at its evaluation point; the difference from the linear model is an error."""
    if ledger is None:
        return
    bottles: Bottles = world.bottles
    begin, stop = share(worker, bottles.x.size)
    change, way, product = linear.change, linear.way, linear.product
    for first in range(begin, stop, BLOCK):
        end = min(first + BLOCK, stop)
        # The arrays of the finished search temporarily hold the new state.
        for i in range(uint64(first), uint64(end)):
            way.x[i], way.y[i], product.x[i], product.y[i] = bottles.x[i], bottles.y[i], bottles.vx[i], bottles.vy[i]
            bottles.vx[i] -= change.x[i]
            bottles.vy[i] -= change.y[i]
        _predict(world, theta * dt, theta, first, end)
        _set_velocities(bottles, world.spin, linear, 1.0 - theta, True, first, end)
    pack_all(world, worker)
    pair_phase(world, worker, dt, 0.0)
    for first in range(begin, stop, BLOCK):
        end = min(first + BLOCK, stop)
        bottle_forces(world, worker, dt, 0.0, first, end)
        _set_velocities(bottles, world.spin, linear, 0.5, False, first, end)
        note_powers(bottles, world.spin, world.load, ledger, 0.0, 0, first, end)
        book(ledger, 0, dt, first, end)
        _set_velocities(bottles, world.spin, linear, 0.0, False, first, end)
        for i in range(uint64(first), uint64(end)):
            bottles.x[i], bottles.y[i] = way.x[i], way.y[i]


@part
def _set_velocities(bottles: Bottles, spin: Any, linear: Linear, back: float, keep: bool, first: int, end: int) -> None:
    """Set velocities to the stored ones after the step minus a share of its change; keep: store those of spin first."""
    change, kept = linear.change, linear.product
    for i in range(uint64(first), uint64(end)):
        bottles.vx[i] = kept.x[i] - back * change.x[i]
        bottles.vy[i] = kept.y[i] - back * change.y[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            if keep:
                kept.turn[i] = spin.omega[i]
            spin.omega[i] = kept.turn[i] - back * change.turn[i]

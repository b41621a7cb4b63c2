# SPDX-License-Identifier: Apache-2.0
"""Begin and end of a substep: friction under the bottles, warm start, positions."""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.impulses import BODY, CONTACTS, ROW
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import implicit_slip
from conveyor_sim.engine.integrators.motion import settle
from conveyor_sim.engine.threads.workers import wait_for_all

_BODY, _FREE = uint64(BODY), uint64(4)


@part
def begin_substep(world: World, impulses: Any, h: float, first: int, end: int) -> None:
    """Apply the impulses that contacts hold to bottles first to end, then base friction over h (s).

    So the friction under a bottle that contacts keep at rest is that at rest, on slow belts as well.
    """
    bottles, body, free, warm = world.bottles, impulses.body, impulses.free, impulses.warm
    for i in range(uint64(first), uint64(end)):
        vx, vy = _on_base(world, world.footing, warm.x[i], warm.y[i], h, i)
        b, f = i * _BODY, i * _FREE
        body[b] = bottles.x[i]
        body[b + uint64(1)] = bottles.y[i]
        body[b + uint64(2)] = vx
        body[b + uint64(3)] = vy
        body[b + uint64(5)] = bottles.inverse_mass[i]
        body[b + uint64(7)] = bottles.radius[i]
        free[f] = vx - warm.x[i]
        free[f + uint64(1)] = vy - warm.y[i]
    _begin_turn(world, world.spin, impulses, first, end)


@part
def _begin_turn(world: World, spin: Any, impulses: Any, first: int, end: int) -> None:
    bottles, body, free = world.bottles, impulses.body, impulses.free
    if spin is None:
        return
    for i in range(uint64(first), uint64(end)):
        radius = bottles.radius[i]
        rim = radius * spin.omega[i]
        body[i * _BODY + uint64(4)] = rim + impulses.warm.turn[i]
        body[i * _BODY + uint64(6)] = radius * radius * spin.inverse_inertia[i]
        free[i * _FREE + uint64(2)] = rim


@part
def _on_base(world: World, footing: Any, warm_x: float, warm_y: float, h: float, i: int) -> tuple[float, float]:
    """Return the velocity of bottle i after its contacts and the friction under it have acted for h (s), implicitly.

    warm_x, warm_y: change of velocity by the contacts, m/s.
    The belt's velocity is that at the middle of the way. The friction curve is evaluated at the slip at the end.
    """
    bottles, limit = world.bottles, world.settings.slip_limit
    if footing is None:
        return bottles.vx[i] + warm_x, bottles.vy[i] + warm_y
    ux, uy = belt_velocity(bottles, footing, h, i)
    vx, vy = bottles.vx[i] + warm_x - ux, bottles.vy[i] + warm_y - uy
    slip = math.sqrt(vx * vx + vy * vy)
    rest = implicit_slip(slip, h * footing.friction_limit[i] * bottles.inverse_mass[i] / limit, limit, None)
    share = rest / slip if slip > 0.0 else 0.0
    return ux + share * vx, uy + share * vy


@part
def belt_velocity(bottles: Bottles, footing: Any, h: float, i: int) -> tuple[float, float]:
    """Return the velocity (m/s) of the belt under bottle i at the middle of its way in a substep of h (s)."""
    ux, uy = footing.ux[i], footing.uy[i]
    if footing.turn is not None:
        ux -= footing.turn[i] * (bottles.y[i] + 0.5 * h * bottles.vy[i])
        uy += footing.turn[i] * (bottles.x[i] + 0.5 * h * bottles.vx[i])
    return ux, uy


@part
def end_substep(world: World, impulses: Any, h: float, first: int, end: int) -> None:
    """Store the velocity that contacts gave bottles first to end, and move them for h (s)."""
    bottles, body, free, warm = world.bottles, impulses.body, impulses.free, impulses.warm
    for i in range(uint64(first), uint64(end)):
        b, f = i * _BODY, i * _FREE
        vx, vy = body[b + uint64(2)], body[b + uint64(3)]
        warm.x[i] = settle(vx - free[f])
        warm.y[i] = settle(vy - free[f + uint64(1)])
        vx, vy = settle(vx), settle(vy)
        bottles.vx[i] = vx
        bottles.vy[i] = vy
        bottles.x[i] = body[b] + h * vx
        bottles.y[i] = body[b + uint64(1)] + h * vy
    _end_turn(world, world.spin, impulses, h, first, end)


@part
def _end_turn(world: World, spin: Any, impulses: Any, h: float, first: int, end: int) -> None:
    bottles, body, free, warm = world.bottles, impulses.body, impulses.free, impulses.warm
    if spin is None:
        return
    for i in range(uint64(first), uint64(end)):
        rim = body[i * _BODY + uint64(4)]
        warm.turn[i] = settle(rim - free[i * _FREE + uint64(2)])
        radius, omega = bottles.radius[i], spin.omega[i]
        # A product that is divided again may differ in the last bit, and a bottle that nothing touches must not drift.
        turned = omega if rim == radius * omega else rim / radius
        spin.omega[i] = settle(turned)
        spin.theta[i] += h * spin.omega[i]


@part
def warm_anew(world: World, worker: Worker, impulses: Any) -> None:
    """Sum the impulses that contacts hold, by bottle, if the lists were rebuilt: contacts may have gone."""
    if impulses.anew[0] == 0:
        return
    wait_for_all(worker)
    if worker.rank == 0:
        _sum(world, impulses)
        impulses.anew[0] = 0
    wait_for_all(worker)


@part
def take_step(world: World, impulses: Any, h: float) -> None:
    """Scale all held impulses to substeps of h (s) if the last substep had another length: forces stay the same."""
    before = impulses.step[0]
    if before != h and before > 0.0:
        ratio = h / before
        _scale_pairs(world.pairs, ratio)
        _scale_near(world.near_segments, ratio)
        _scale_near(world.near_arcs, ratio)
        _scale_bodies(impulses.bodies, ratio)
        impulses.anew[0] = 1
    impulses.step[0] = h


@part
def _scale_pairs(pairs: Any, ratio: float) -> None:
    if pairs is None:
        return
    _scale(pairs.impulse.row, pairs.used[0], ratio)


@part
def _scale_near(near: Any, ratio: float) -> None:
    if near is None:
        return
    _scale(near.impulse.row, near.start[near.start.size - 1], ratio)


@part
def _scale_bodies(bodies: Any, ratio: float) -> None:
    if bodies is None:
        return
    _scale(bodies.row, bodies.piece.size, ratio)


@part
def _scale(rows: Any, count: int, ratio: float) -> None:
    for entry in range(count):
        rows[ROW * entry] *= ratio
        rows[ROW * entry + 1] *= ratio
        rows[ROW * entry + 2] *= ratio


@part
def _sum(world: World, impulses: Any) -> None:
    warm = impulses.warm
    for i in range(world.bottles.x.size):
        warm.x[i] = warm.y[i] = warm.turn[i] = 0.0
    _sum_pairs(world, world.pairs, impulses)
    _sum_near(world, world.near_segments, impulses)
    _sum_near(world, world.near_arcs, impulses)
    _sum_bodies(world, impulses, impulses.bodies)


@part
def _sum_pairs(world: World, pairs: Any, impulses: Any) -> None:
    if pairs is None:
        return
    held = pairs.impulse
    for p in range(pairs.used[0]):
        _add(world, impulses, held.i[p], held.row, ROW * p, -1.0)
        _add(world, impulses, held.j[p], held.row, ROW * p, 1.0)


@part
def _sum_near(world: World, near: Any, impulses: Any) -> None:
    if near is None:
        return
    for i in range(world.bottles.x.size):
        for entry in range(near.start[i], near.start[i + 1]):
            _add(world, impulses, i, near.impulse.row, ROW * entry, -1.0)


@part
def _sum_bodies(world: World, impulses: Any, bodies: Any) -> None:
    if bodies is None:
        return
    for place in range(bodies.piece.size):
        if bodies.piece[place] >= 0:
            _add(world, impulses, place // CONTACTS, bodies.row, ROW * place, -1.0)


@part
def _add(world: World, impulses: Any, i: int, rows: Any, row: int, sign: float) -> None:
    warm, mass = impulses.warm, world.bottles.inverse_mass[i]
    warm.x[i] += sign * (mass * rows[row])
    warm.y[i] += sign * (mass * rows[row + 1])
    warm.turn[i] += impulses.turning[world.bottles.type[i]] * rows[row + 2]

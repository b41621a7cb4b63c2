# SPDX-License-Identifier: Apache-2.0
"""Contacts of bottle pairs in the linearly implicit method (`tangent.py`)."""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.contacts import Pairs
from conveyor_sim.engine.arrays.integrators import Blocks, Linear
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.pairs import normal_and_overlap
from conveyor_sim.engine.contact.slots import WIDTH
from conveyor_sim.engine.integrators.tangent import contact_stiffness, linear_contact
from conveyor_sim.engine.threads.workers import UNIT, share


@part
def stiffest_pairs(world: World, worker: Worker) -> None:
    """Write to `pairs.tangent.most`, for each unit, the largest stiffness times mobility (1/s^2) of closed contacts.

    These are closed at `bottles.x` or were so before the step.
    """
    bottles, pairs = world.bottles, world.pairs
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    for first in range(begin, stop, UNIT):
        most = 0.0
        for p in range(uint64(first), uint64(min(first + UNIT, stop))):
            i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
            ahead, before, _, _ = _overlaps(bottles, world.linear, i, j)
            depth = ahead if ahead > before else before
            if depth > 0.0:
                stiffness = contact_stiffness(world, pairs.law, p, depth, 1.0)
                rate = stiffness * (bottles.inverse_mass[i] + bottles.inverse_mass[j])
                most = rate if rate > most else most
        pairs.tangent.most[first // UNIT] = most


@part
def linear_pairs(world: World, worker: Worker, step: tuple[float, float], again: int) -> None:
    """Compute forces and moments ahead, and `pairs.tangent`, of this worker's share of the pairs.

    Normal forces, for peaks, are those before the step. step: as in `linear_contact`.
    """
    pairs = world.pairs
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    for p in range(uint64(begin), uint64(stop)):
        i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
        ahead, before, nx, ny = _overlaps(world.bottles, world.linear, i, j)
        hold = step[1] > 0.5 and (before > 0.0 or (again > 0 and pairs.tangent.normal[p] > 0.0))
        if ahead > 0.0 or before > 0.0 or hold:
            _close(world, p, (before, ahead), nx, ny, step, hold)
        else:
            _write(pairs, p, 0.0, 0.0, 0.0, 0.0)
            _note_normal(pairs, p, 0.0)
            pairs.tangent.normal[p] = 0.0
            pairs.tangent.tangential[p] = 0.0


@part
def _overlaps(bottles: Bottles, linear: Linear, i: int, j: int) -> tuple[float, float, float, float]:
    """Return the overlaps (m) ahead and before, and the normal ahead."""
    reach = bottles.radius[i] + bottles.radius[j]
    ahead, nx, ny = normal_and_overlap(bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i], reach)
    dx, dy = linear.x[j] - linear.x[i], linear.y[j] - linear.y[i]
    return ahead, reach - math.sqrt(dx * dx + dy * dy), nx, ny


@part
def _close(
    world: World,
    p: int,
    overlaps: tuple[float, float],
    nx: float,
    ny: float,
    step: tuple[float, float],
    hold: bool,
) -> None:
    """Compute one pair. overlaps, step, hold: as in `linear_contact`."""
    bottles, spin, pairs, change = world.bottles, world.spin, world.pairs, world.linear.change
    i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
    vx, vy = bottles.vx[i] - bottles.vx[j], bottles.vy[i] - bottles.vy[j]
    dvx, dvy = change.x[i] - change.x[j], change.y[i] - change.y[j]
    slip, slip_change = vy * nx - vx * ny, dvy * nx - dvx * ny
    mobility = rim_mobility = bottles.inverse_mass[i] + bottles.inverse_mass[j]
    arm_i = arm_j = 0.0
    if spin is not None:
        shorter = 0.5 * world.settings.lever * overlaps[1]
        arm_i, arm_j = bottles.radius[i] - shorter, bottles.radius[j] - shorter
        slip += spin.omega[i] * arm_i + spin.omega[j] * arm_j
        slip_change += change.turn[i] * arm_i + change.turn[j] * arm_j
        rim_mobility += arm_i * arm_i * spin.inverse_inertia[i] + arm_j * arm_j * spin.inverse_inertia[j]
    normal, tangential, along, across, normal_before = linear_contact(
        world,
        pairs.law,
        p,
        overlaps,
        1.0,
        (vx * nx + vy * ny, (vx + step[1] * dvx) * nx + (vy + step[1] * dvy) * ny),
        slip,
        (mobility, rim_mobility),
        step,
        hold,
    )
    tangential -= across * slip_change / step[0]
    tangent = pairs.tangent
    tangent.nx[p] = nx
    tangent.ny[p] = ny
    tangent.arm_i[p] = arm_i
    tangent.arm_j[p] = arm_j
    tangent.normal[p] = along
    tangent.tangential[p] = across
    fx, fy = -normal * nx - tangential * ny, tangential * nx - normal * ny
    _write(pairs, p, fx, fy, arm_i * tangential, arm_j * tangential)
    _note_normal(pairs, p, normal_before)


@part
def _write(pairs: Pairs, p: int, fx: float, fy: float, moment_i: float, moment_j: float) -> None:
    q = p + uint64(pairs.i.size)
    pairs.fx[p] = fx
    pairs.fy[p] = fy
    pairs.fx[q] = -fx
    pairs.fy[q] = -fy
    if pairs.moment is not None:
        pairs.moment[p] = moment_i
        pairs.moment[q] = moment_j


@part
def _note_normal(pairs: Pairs, p: int, normal: float) -> None:
    if pairs.normal is not None:
        pairs.normal[p] = normal
        pairs.normal[p + uint64(pairs.i.size)] = normal


@part
def resist_pairs(pairs: Any, direction: Any, old: Any, beta: float, worker: Worker) -> None:
    """Write, by pair, the impulses with which this worker's pairs resist velocities direction + beta old (Triples)."""
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    for p in range(uint64(begin), uint64(stop)):
        _resist(pairs, direction, old, beta, p)


@part
def _resist(pairs: Pairs, direction: Any, old: Any, beta: float, p: int) -> None:
    tangent: Any = pairs.tangent
    i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
    nx, ny = tangent.nx[p], tangent.ny[p]
    vx = (direction.x[i] + beta * old.x[i]) - (direction.x[j] + beta * old.x[j])
    vy = (direction.y[i] + beta * old.y[i]) - (direction.y[j] + beta * old.y[j])
    slip = vy * nx - vx * ny
    arm_i, arm_j = tangent.arm_i[p], tangent.arm_j[p]
    if pairs.moment is not None:
        slip += (direction.turn[i] + beta * old.turn[i]) * arm_i + (direction.turn[j] + beta * old.turn[j]) * arm_j
    along, across = tangent.normal[p] * (vx * nx + vy * ny), tangent.tangential[p] * slip
    _write(pairs, p, along * nx - across * ny, along * ny + across * nx, across * arm_i, across * arm_j)


@part
def add_pair_blocks(pairs: Any, slots: Any, blocks: Blocks, first: int, end: int) -> None:
    """Add to the blocks of bottles first to end the resistance of their pairs to their own velocities."""
    if pairs is None:
        return
    for i in range(first, end):
        for place in range(i * WIDTH, (i + 1) * WIDTH):
            _add_pair_block(pairs, slots.entry[place], blocks, i)
    for place in range(slots.more_start[first], slots.more_start[end]):
        _add_pair_block(pairs, slots.more_entry[place], blocks, slots.more_bottle[place])


@part
def _add_pair_block(pairs: Any, entry: int, blocks: Blocks, i: int) -> None:
    count = pairs.i.size
    if entry == 2 * count:
        return
    tangent = pairs.tangent
    first = entry < count
    p = entry if first else entry - count
    # For the second bottle of a pair the normal is reversed.
    nx, ny = (tangent.nx[p], tangent.ny[p]) if first else (-tangent.nx[p], -tangent.ny[p])
    add_block(
        blocks, i, tangent.normal[p], tangent.tangential[p], nx, ny, tangent.arm_i[p] if first else tangent.arm_j[p]
    )


@part
def add_block(blocks: Blocks, i: int, along: float, across: float, nx: float, ny: float, arm: float) -> None:
    """Add to the block of bottle i a resistance (kg) along a normal away from it, and one across it at an arm (m)."""
    blocks.xx[i] += along * nx * nx + across * ny * ny
    blocks.xy[i] += (along - across) * nx * ny
    blocks.yy[i] += along * ny * ny + across * nx * nx
    blocks.xt[i] -= across * ny * arm
    blocks.yt[i] += across * nx * arm
    blocks.tt[i] += across * arm * arm

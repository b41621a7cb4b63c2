# SPDX-License-Identifier: Apache-2.0
"""Conjugate gradients for the linearly implicit method: (M + resistance) dv = h F, with 3 x 3 blocks per bottle.

The preconditioner is the factorised blocks. Products are computed as forces are: by pair, then summed by bottle in a
fixed order. Scalar products are added up by units of bottles, in order. So the bits do not depend on the number of
threads. (Saad, Iterative Methods for Sparse Linear Systems, algorithm 9.1.)

At the end the residual impulse of each bottle changes the velocity of that bottle alone. The sum of all impulses is
then that of the forces, which are equal and opposite. So momentum is conserved to rounding however early the search
ends.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.integrators import Blocks, Linear, Triple
from conveyor_sim.engine.arrays.world import Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.slots import sum_slots
from conveyor_sim.engine.integrators.tangent_pairs import resist_pairs
from conveyor_sim.engine.threads.workers import UNIT, share, wait_for_all

RELATIVE = 1e-8
"""Tolerated residual, as a share of the largest kick that the forces alone would give in the step."""

LEAST = 1e-9
"""Kicks below this speed, m/s, are neglected."""

MOST_ROUNDS = 1000
"""Rounds after which the search ends. The solution at that point still reduces the error."""


@part
def factor(own: Blocks, inverse: Blocks, first: int, end: int) -> None:
    """Factorise the blocks in `inverse` of bottles first to end into L D L^T, in place: xx, yy, tt are then 1/D."""
    for i in range(uint64(first), uint64(end)):
        inverse_x = 1.0 / inverse.xx[i]
        xy, xt = inverse.xy[i] * inverse_x, inverse.xt[i] * inverse_x
        inverse_y = 1.0 / (inverse.yy[i] - xy * inverse.xy[i])
        left = inverse.yt[i] - xt * inverse.xy[i]
        yt = left * inverse_y
        inverse.tt[i] = 1.0 / (inverse.tt[i] - xt * inverse.xt[i] - yt * left)
        inverse.xx[i] = inverse_x
        inverse.yy[i] = inverse_y
        inverse.xy[i] = xy
        inverse.xt[i] = xt
        inverse.yt[i] = yt


@part
def begin_search(bottles: Bottles, spin: Any, load: ForceSums, linear: Linear, dt: float, first: int, end: int) -> None:
    """Start from the present change, with the impulse of `load` in dt (s), of bottles first to end."""
    left, own = linear.left, linear.own
    for i in range(uint64(first), uint64(end)):
        x, y, turn = linear.change.x[i], linear.change.y[i], linear.change.turn[i]
        left.x[i] = dt * load.fx[i] - (own.xx[i] * x + own.xy[i] * y + own.xt[i] * turn)
        left.y[i] = dt * load.fy[i] - (own.xy[i] * x + own.yy[i] * y + own.yt[i] * turn)
        moment = dt * spin.moment[i] if spin is not None else 0.0
        left.turn[i] = moment - (own.xt[i] * x + own.yt[i] * y + own.tt[i] * turn)
        linear.way.x[i] = linear.way.y[i] = linear.way.turn[i] = 0.0
    _precondition(bottles, spin, linear, first, end)


@part
def search(world: World, worker: Worker, small: float) -> bool:
    """Solve for `linear.change`; return True if the residual is at most `small`.

    All workers must have begun; every worker calls it with the same arguments.
    """
    bottles: Bottles = world.bottles
    linear: Any = world.linear
    begin, stop = share(worker, bottles.x.size)
    most = largest_kick(linear)
    before, beta, rounds = _total(linear.left_sum), 0.0, 0
    while most > small and rounds < MOST_ROUNDS:
        resist_pairs(world.pairs, linear.product, linear.way, beta, worker)
        wait_for_all(worker)
        for first in range(begin, stop, UNIT):
            _new_direction(world.pairs, world.slots, linear, beta, first, min(first + UNIT, stop))
        wait_for_all(worker)
        alpha = before / _total(linear.way_sum)
        for first in range(begin, stop, UNIT):
            _step(linear, alpha, first, min(first + UNIT, stop))
            _precondition(bottles, world.spin, linear, first, min(first + UNIT, stop))
        wait_for_all(worker)
        after = _total(linear.left_sum)
        beta, before = after / before, after
        most = _largest(linear.most)
        rounds += 1
    return not most > small


@part
def largest_kick(linear: Linear) -> float:
    """Return the largest change of a bottle's own velocity that its residual impulse would cause, m/s."""
    return _largest(linear.most)


@part
def _total(column: Any) -> float:
    total = 0.0
    for unit in range(column.size):
        total += column[unit]
    return total


@part
def _largest(column: Any) -> float:
    most = 0.0
    for unit in range(column.size):
        most = column[unit] if column[unit] > most else most
    return most


@part
def _precondition(bottles: Bottles, spin: Any, linear: Linear, first: int, end: int) -> None:
    """Compute by units: inverse blocks times residual, its product with the residual, and the largest kick."""
    left, product, inverse = linear.left, linear.product, linear.inverse
    for start in range(first, end, UNIT):
        total = most = 0.0
        for i in range(uint64(start), uint64(min(start + UNIT, end))):
            x = left.x[i]
            y = left.y[i] - inverse.xy[i] * x
            turn = left.turn[i] - inverse.xt[i] * x - inverse.yt[i] * y
            turn *= inverse.tt[i]
            y = y * inverse.yy[i] - inverse.yt[i] * turn
            x = x * inverse.xx[i] - inverse.xy[i] * y - inverse.xt[i] * turn
            product.x[i] = x
            product.y[i] = y
            product.turn[i] = turn
            total += x * left.x[i] + y * left.y[i] + turn * left.turn[i]
            kick = max(abs(left.x[i]), abs(left.y[i])) * bottles.inverse_mass[i]
            if spin is not None:
                kick = max(kick, abs(left.turn[i]) * spin.inverse_inertia[i] * bottles.radius[i])
            most = kick if kick > most else most
        linear.left_sum[start // UNIT] = total
        linear.most[start // UNIT] = most


@part
def _new_direction(pairs: Any, slots: Any, linear: Linear, beta: float, first: int, end: int) -> None:
    """Compute for a unit of bottles the new direction, the matrix times it, and their scalar product."""
    way, product, own = linear.way, linear.product, linear.own
    for i in range(uint64(first), uint64(end)):
        way.x[i] = product.x[i] + beta * way.x[i]
        way.y[i] = product.y[i] + beta * way.y[i]
        way.turn[i] = product.turn[i] + beta * way.turn[i]
    _sum_pairs(pairs, slots, product, first, end)
    total = 0.0
    for i in range(uint64(first), uint64(end)):
        x, y, turn = way.x[i], way.y[i], way.turn[i]
        product.x[i] += own.xx[i] * x + own.xy[i] * y + own.xt[i] * turn
        product.y[i] += own.xy[i] * x + own.yy[i] * y + own.yt[i] * turn
        product.turn[i] += own.xt[i] * x + own.yt[i] * y + own.tt[i] * turn
        total += x * product.x[i] + y * product.y[i] + turn * product.turn[i]
    linear.way_sum[first // UNIT] = total


@part
def _sum_pairs(pairs: Any, slots: Any, product: Triple, first: int, end: int) -> None:
    for i in range(uint64(first), uint64(end)):
        product.x[i] = product.y[i] = product.turn[i] = 0.0
    if pairs is not None:
        sum_slots(slots, pairs.fx, first, end, product.x)
        sum_slots(slots, pairs.fy, first, end, product.y)
        _sum_moments(pairs.moment, slots, first, end, product.turn)


@part
def _sum_moments(moment: Any, slots: Any, first: int, end: int, sums: Any) -> None:
    if moment is not None:
        sum_slots(slots, moment, first, end, sums)


@part
def _step(linear: Linear, alpha: float, first: int, end: int) -> None:
    change, left, way, product = linear.change, linear.left, linear.way, linear.product
    for i in range(uint64(first), uint64(end)):
        change.x[i] += alpha * way.x[i]
        change.y[i] += alpha * way.y[i]
        change.turn[i] += alpha * way.turn[i]
        left.x[i] -= alpha * product.x[i]
        left.y[i] -= alpha * product.y[i]
        left.turn[i] -= alpha * product.turn[i]


@part
def kick_with_rest(bottles: Bottles, spin: Any, linear: Linear, first: int, end: int) -> None:
    """Add each bottle's residual impulse, divided by its inertia, to its velocity change."""
    change, left = linear.change, linear.left
    for i in range(uint64(first), uint64(end)):
        change.x[i] += left.x[i] * bottles.inverse_mass[i]
        change.y[i] += left.y[i] * bottles.inverse_mass[i]
    if spin is not None:
        for i in range(uint64(first), uint64(end)):
            change.turn[i] += left.turn[i] * spin.inverse_inertia[i]

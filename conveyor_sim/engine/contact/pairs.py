# SPDX-License-Identifier: Apache-2.0
"""Contact of two bottles: overlap delta = R_i + R_j - |r_i - r_j|, for all listed pairs, block by block.

The fast layout, step by step. Pairs p = 0, 1, ... are sorted by (i, j); a block is up to BLOCK consecutive pairs:

    packed   | x y vx vy | x y vx vy | x y vx vy | ...          one row per bottle, renewed before every evaluation
                  i            j                                 1. gather: row j minus row i, one packed load each
    gathered | dx dy du dv | dx dy du dv | ...                   (du, dv: velocity) of this block only, to stay in L1
                  v v v v v v v v                                2. law: eight pairs at a time, no branches; separate
    pairs.fx | on i: 0 .. P-1 | on j: P .. 2P-1 | 0 |               pairs get 0. Written twice, once per partner:
                  ^     ^            ^                               no thread adds to another one's entry
    slots    | P+1  4  5  -  -  - | ...                          3. sum (slots.py): each bottle adds its own entries,
                                                                    six to a row; "-" is the entry that stays 0

Steps 1 and 2 write by pair, step 3 by bottle: no two threads write to the same entry, and every sum has one order, that
of the partners. A scatter to both bottles would need neither copies nor slots, but has races and does not vectorise.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.contacts import Gathered, Pairs
from conveyor_sim.engine.arrays.world import EngineSettings, Worker, World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.contact import carried, contact_parts, history_after, spring_after, stretched
from conveyor_sim.engine.contact.path import displacement_in_touch, slip_time_of
from conveyor_sim.engine.threads.workers import BLOCK, share

# Unsigned, because numba tests signed indices for wrap-around. The offsets in a row would then not be constants.
_1, _2, _3, _4 = uint64(1), uint64(2), uint64(3), uint64(4)


@part
def pack(bottles: Bottles, first: int, end: int) -> None:
    """Copy positions and velocities of bottles first to end into rows."""
    for i in range(uint64(first), uint64(end)):
        pack_row(bottles.packed, i, bottles.x[i], bottles.y[i], bottles.vx[i], bottles.vy[i])


@part
def pack_row(packed: Any, i: int, x: float, y: float, vx: float, vy: float) -> None:
    """Write the row of bottle i. i: unsigned."""
    row = i * _4
    packed[row] = x
    packed[row + _1] = y
    packed[row + _2] = vx
    packed[row + _3] = vy


@part
def pair_forces(world: World, worker: Worker, spring_dt: float) -> None:
    """Compute forces and moments of this worker's share of the pairs, from `bottles.packed` and `spin.omega`.

    spring_dt: s, time by which the tangential springs are advanced (`pair_phase`).
    """
    pairs, gathered = world.pairs, worker.gathered
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    for start in range(begin, stop, BLOCK):
        first: Any = uint64(start)
        count: Any = uint64(min(BLOCK, stop - start))
        _gather(world.bottles.packed, world.spin, pairs, pairs.reach, first, count, gathered)
        _gather_compliance(world.implicit, pairs, first, count, gathered.compliance)
        _gather_kicks(world.implicit, pairs, first, count, gathered.kick)
        _gather_displacements(world.path, pairs, pairs.reach, first, count, gathered.displacement)
        _law(world, gathered, first, count, spring_dt)


@part
def _gather(packed: Any, spin: Any, pairs: Pairs, reach: Any, first: int, count: int, gathered: Any) -> None:
    difference, turn = gathered.difference, gathered.turn
    for c in range(count):
        a, b = uint64(pairs.i[first + c]), uint64(pairs.j[first + c])
        i, j = a * _4, b * _4
        # Loads precede stores, so that the compiler can combine them into vector loads.
        dx = packed[j] - packed[i]
        dy = packed[j + _1] - packed[i + _1]
        dvx = packed[j + _2] - packed[i + _2]
        dvy = packed[j + _3] - packed[i + _3]
        row = c * _4
        difference[row] = dx
        difference[row + _1] = dy
        difference[row + _2] = dvx
        difference[row + _3] = dvy
        if spin is not None:
            turn[c] = spin.omega[a] + spin.omega[b]
    _gather_rims(spin, pairs, reach, first, count, gathered.rim)


@part
def _gather_rims(spin: Any, pairs: Pairs, reach: Any, first: int, count: int, rim: Any) -> None:
    if reach is not None:
        if spin is not None:
            for c in range(count):
                p = first + c
                radius = pairs.radius_i[p]
                rim[c] = radius * spin.omega[pairs.i[p]] + (reach[p] - radius) * spin.omega[pairs.j[p]]


@part
def _gather_compliance(implicit: Any, pairs: Pairs, first: int, count: int, compliance: Any) -> None:
    if implicit is None:
        return
    for c in range(count):
        compliance[c] = implicit.compliance[pairs.i[first + c]] + implicit.compliance[pairs.j[first + c]]


@part
def _gather_kicks(implicit: Any, pairs: Pairs, first: int, count: int, kick: Any) -> None:
    if implicit is not None:
        _gather_displacements(implicit.kick, pairs, pairs.reach, first, count, kick)


@part
def _gather_displacements(path: Any, pairs: Pairs, reach: Any, first: int, count: int, displacement: Any) -> None:
    if path is None:
        return
    for c in range(count):
        p, row = first + c, c * _4
        i, j = uint64(pairs.i[p]), uint64(pairs.j[p])
        displacement[row] = path.x[j] - path.x[i]
        displacement[row + _1] = path.y[j] - path.y[i]
        displacement[row + _2] = path.turn[i] + path.turn[j]
        displacement[row + _3] = 0.0 if reach is None else _rim_displacement(path, pairs, reach, p)


@part
def _rim_displacement(path: Any, pairs: Pairs, reach: Any, p: int) -> float:
    radius = pairs.radius_i[p]
    return radius * path.turn[pairs.i[p]] + (reach[p] - radius) * path.turn[pairs.j[p]]


@part
def normal_and_overlap(dx: float, dy: float, reach: float) -> tuple[float, float, float]:
    """Return overlap (m; 0 or less: apart) and unit normal of two circles. (dx, dy): vector from axis to axis, m."""
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance if distance > 0.0 else 0.0
    # Coincident centres have no normal; any constant one separates them.
    return reach - distance, dx * inverse if distance > 0.0 else 1.0, dy * inverse


@part
def _law(world: World, gathered: Gathered, first: int, count: int, spring_dt: float) -> None:
    settings, path, pairs = world.settings, world.path, world.pairs
    reach, springs = pairs.reach, pairs.spring
    difference, other = gathered.difference, first + uint64(pairs.i.size)
    half = 0.5 * settings.lever
    for c in range(count):
        row, p, q = c * _4, first + c, other + c
        dvx, dvy = difference[row + _2], difference[row + _3]
        overlap, nx, ny = normal_and_overlap(difference[row], difference[row + _1], _reach(settings, reach, p))
        closing = -(dvx * nx + dvy * ny)
        slip = dvx * ny - dvy * nx + _rim_slip(settings, world.spin, reach, gathered, c, half * overlap)
        if path is None:
            kept, deeper, slipped = elongation(springs, p), closing * spring_dt, slip * spring_dt
            spring = carried(pairs.law, p, kept, overlap, deeper, slipped)
        else:
            spring = _drawn_out(world, gathered, c, p, overlap, nx, ny)
        slip_time = slip_time_of(path, spring_dt)
        start = _first_slip(world, gathered, c, p, slip, nx, ny, half * overlap)
        normal, tangential, friction = contact_parts(
            pairs.law,
            p,
            world.curves,
            settings.slip_limit,
            settings.atan,
            overlap,
            1.0,
            closing,
            slip,
            stretched(spring, slip, slip_time),
            _compliance(settings, world.implicit, gathered, c, start),
        )
        fx = -normal * nx - tangential * ny
        fy = tangential * nx - normal * ny
        pairs.fx[p] = fx
        pairs.fy[p] = fy
        pairs.fx[q] = -fx
        pairs.fy[q] = -fy
        if pairs.moment is not None:
            radius_i, radius_j = _radii(settings, pairs, reach, p)
            pairs.moment[p] = (radius_i - half * overlap) * tangential
            pairs.moment[q] = (radius_j - half * overlap) * tangential
        if pairs.normal is not None:
            pairs.normal[p] = normal
            pairs.normal[q] = normal
        if springs is not None:
            springs.elongation[p] = _history_after(
                world, p, spring, overlap, slip, slip_time, normal, friction, spring_dt
            )


@part
def _reach(settings: EngineSettings, reach: Any, p: int) -> float:
    if reach is None:
        return settings.reach
    return reach[p]


@part
def _radii(settings: EngineSettings, pairs: Pairs, reach: Any, p: int) -> tuple[float, float]:
    if reach is None:
        return 0.5 * settings.reach, 0.5 * settings.reach
    return pairs.radius_i[p], reach[p] - pairs.radius_i[p]


@part
def _rim_slip(settings: EngineSettings, spin: Any, reach: Any, gathered: Any, c: int, shorter: float) -> float:
    """Return the slip of the rims, m/s: omega_i arm_i + omega_j arm_j; arms are radii minus half the overlap."""
    if spin is None:
        return 0.0
    if reach is None:
        return (0.5 * settings.reach - shorter) * gathered.turn[c]
    return gathered.rim[c] - shorter * gathered.turn[c]


@part
def elongation(springs: Any, p: int) -> Any:
    """Return the elongation (m) of the tangential spring of pair p, or None."""
    if springs is None:
        return None
    return springs.elongation[p]


@part
def _drawn_out(world: World, gathered: Gathered, c: int, p: int, overlap: float, nx: float, ny: float) -> Any:
    """Return the elongation (m) of a spring after the displacement of its bottles since the last update, or None."""
    settings, pairs = world.settings, world.pairs
    if pairs.spring is None:
        return None
    spring, reach = pairs.spring.elongation[p], pairs.reach
    displacement: Any = gathered.displacement
    row: Any = c * _4
    approach = -(displacement[row] * nx + displacement[row + _1] * ny)
    # The normal turns during the displacement d. The normal at its middle is used: d x n_mid = |r| (d x n) / |r_mid|.
    distance = _reach(settings, reach, p) - overlap
    along = (displacement[row] * ny - displacement[row + _1] * nx) * (distance / (distance + 0.5 * approach))
    shorter = 0.5 * settings.lever * (overlap - 0.5 * approach)
    further = displacement_in_touch(
        along + _rims_displacement(settings, reach, displacement, row, shorter), approach, overlap
    )
    return carried(pairs.law, p, spring, overlap, approach, further) + further


@part
def _rims_displacement(settings: EngineSettings, reach: Any, displacement: Any, row: int, shorter: float) -> float:
    if reach is None:
        return (0.5 * settings.reach - shorter) * displacement[row + _2]
    return displacement[row + _3] - shorter * displacement[row + _2]


@part
def _history_after(
    world: World,
    p: int,
    spring: float,
    overlap: float,
    slip: float,
    slip_time: float,
    normal: float,
    friction: float,
    spring_dt: float,
) -> float:
    """Return the new history of pair p: elongation (m) or friction (N), see `PairSprings.elongation`."""
    pairs = world.pairs
    kept = pairs.spring.elongation[p]
    if world.settings.warm is not None:
        return history_after(pairs.law, p, spring, kept, overlap, slip, slip_time, spring_dt, normal, 1.0, friction)
    after = spring_after(pairs.law, p, spring, overlap, slip, slip_time, normal, 1.0)
    return after if spring_dt > 0.0 else kept


@part
def _first_slip(
    world: World, gathered: Gathered, c: int, p: int, slip: float, nx: float, ny: float, shorter: float
) -> float:
    """Return the slip (m/s) from which the implicit solver starts, without the friction of the last evaluation."""
    settings, implicit, pairs = world.settings, world.implicit, world.pairs
    if implicit is None:
        return slip
    if settings.warm is None:
        return slip
    return (
        slip
        + _slip_of_kick(settings, implicit.kick, pairs.reach, gathered.kick, c * _4, nx, ny, shorter)
        - gathered.compliance[c] * pairs.spring.elongation[p]
    )


@part
def _slip_of_kick(
    settings: EngineSettings, kick: Any, reach: Any, gathered: Any, row: Any, nx: float, ny: float, shorter: float
) -> float:
    if kick is None:
        return 0.0
    along = gathered[row] * ny - gathered[row + _1] * nx
    return along + _rims_displacement(settings, reach, gathered, row, shorter)


@part
def _compliance(settings: EngineSettings, implicit: Any, gathered: Any, c: int, start: float) -> Any:
    if implicit is None:
        return None
    return gathered.compliance[c], settings.at_once, start


@part
def find_touching(settings: EngineSettings, bottles: Bottles, pairs: Any, worker: Worker) -> None:
    """Mark the closed pairs of this worker's share in `pairs.touch`, for the implicit solver."""
    if pairs is None:
        return
    begin, stop = share(worker, pairs.used[0])
    for p in range(uint64(begin), uint64(stop)):
        i, j = uint64(pairs.i[p]) * _4, uint64(pairs.j[p]) * _4
        dx = bottles.packed[j] - bottles.packed[i]
        dy = bottles.packed[j + _1] - bottles.packed[i + _1]
        reach = _reach(settings, pairs.reach, p)
        closed = 1.0 if dx * dx + dy * dy < reach * reach else 0.0
        pairs.touch[p] = closed
        pairs.touch[p + uint64(pairs.i.size)] = closed

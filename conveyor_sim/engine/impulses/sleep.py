# SPDX-License-Identifier: Apache-2.0
"""Sleeping: bottles at rest whose contacts hold constant impulses are not stepped, on a belt at rest or in motion.

Once a tick, in the order of slots and pairs:

1. An island of sleepers wakes if one of its bottles was moved, removed or changed from outside, if the surface under it
   changed its speed, if an awake bottle will touch it, or if the forces of other bottles on one of them, summed as
   magnitudes, changed by more than WAKING of the friction under it.
2. A bottle is quiet in a tick if it moves by less than PLACE, all forces on it balance within BALANCE of the friction
   under it, and the sum changes by less than CONSTANT of that friction. Near the sweep of a body none is quiet.
3. An island falls asleep if all its bottles were quiet for TICKS; a part of an island if its bottles, and all that they
   touch, were quiet for LONG. The velocity of sleepers becomes 0. Islands are bottles that touch each other.

For an awake neighbour a sleeper is a body without motion whose contact holds its impulse. Lists that are rebuilt during
a tick wake islands that a bottle will touch (`carry.py`).
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.impulses import BODY, ROW
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.impulses.carry import group_pairs
from conveyor_sim.engine.impulses.meeting import mark_met, wake_marked
from conveyor_sim.engine.impulses.runs import plan_runs
from conveyor_sim.engine.rails.arc import arc_contact
from conveyor_sim.engine.rails.segment import segment_contact

TICKS, LONG = 20, 100
"""Ticks of quiet after which an island may sleep, and a part of one."""

BALANCE = 0.01
"""Sum of all forces on a quiet bottle, over the friction under it. A substep turns it into a velocity."""

SLOW = 2e-3
"""Speed below which a bottle is quiet in any case, m/s."""

PLACE = 1e-6
"""Way of a quiet bottle in a tick, along x and along y, m."""

DEEP = 0.05
"""Share of the forces of other bottles that counts like friction under a bottle. Deep in a crowd, forces that balance
each other wander."""

CONSTANT = 0.05
"""Change of the forces of other bottles on a quiet bottle in a tick, over that sum of friction and forces."""

WAKING = 0.2
"""Change of these forces that wakes an island, over the same sum."""


@kernel
def decide_sleep(world: World, h: float, steps: int) -> None:
    """Wake islands, put others to sleep, and book the loads of sleepers for a tick of `steps` substeps of h (s)."""
    impulses: Any = world.impulses
    sleep: Any = impulses.sleep
    changed = False
    if sleep.sleepers[0] > 0:
        changed = _wake(world, impulses, sleep, h * steps)
    _note_surfaces(world.surface, sleep.surfaces)
    if _count_quiet(world, impulses, sleep):
        changed = _fall_asleep(world, impulses, sleep) or changed
    if changed:
        group_pairs(world.bottles, world.pairs, impulses)
        _weigh(world, impulses, sleep, sleep.loads)
    if sleep.sleepers[0] > 0:
        plan_runs(world.bottles, sleep)
        _hold_still(world.bottles, impulses.body, sleep)
        _book(world.peaks, sleep, sleep.loads, h * steps)
    sleep.ahead[0] = h * steps
    sleep.ticks[0] += sleep.sleepers[0]
    for i in range(world.bottles.id.size):
        sleep.ticks[1] += world.bottles.id[i] >= 0


@part
def _wake(world: World, impulses: Any, sleep: Any, tick: float) -> bool:
    """Wake islands that something disturbs. Return True if one woke. tick: s."""
    bottles = world.bottles
    awake = 0
    for i in range(bottles.id.size):
        sleep.mark[i] = 0
        awake += sleep.asleep[i] == 0 and bottles.id[i] >= 0
    for i in range(bottles.id.size):
        if sleep.asleep[i] != 0 and (_is_edited(bottles, sleep, i) or _turns(world.spin, i)):
            sleep.mark[sleep.island[i]] = 1
    _mark_surfaces(world, world.surface, sleep, sleep.surfaces)
    if awake > 0:
        _mark_changed(world, world.pairs, world.footing, impulses, sleep)
        mark_met(bottles, world.pairs, sleep, tick)
    return wake_marked(bottles, impulses, sleep)


@part
def _is_edited(bottles: Any, sleep: Any, i: int) -> bool:
    if bottles.id[i] != sleep.id[i] or bottles.type[i] != sleep.type[i]:
        return True
    if bottles.x[i] != sleep.x[i] or bottles.y[i] != sleep.y[i]:
        return True
    return bottles.vx[i] != 0.0 or bottles.vy[i] != 0.0


@part
def _turns(spin: Any, i: int) -> bool:
    if spin is None:
        return False
    return spin.omega[i] != 0.0


@part
def _mark_surfaces(world: World, surface: Any, sleep: Any, seen: Any) -> None:
    """Mark islands on a surface whose velocity is not that of the last tick."""
    if surface is None:
        return
    for i in range(world.bottles.id.size):
        if sleep.asleep[i] != 0:
            h = world.footing.carrier[i]
            if (
                surface.ux[h] != seen.ux[h]
                or surface.uy[h] != seen.uy[h]
                or _turns_otherwise(surface.turn, seen.turn, h)
            ):
                sleep.mark[sleep.island[i]] = 1


@part
def _turns_otherwise(turn: Any, seen: Any, h: int) -> bool:
    if turn is None:
        return False
    return turn[h] != seen[h]


@part
def _note_surfaces(surface: Any, seen: Any) -> None:
    if surface is None:
        return
    for h in range(surface.ux.size):
        seen.ux[h] = surface.ux[h]
        seen.uy[h] = surface.uy[h]
    _note_turns(surface.turn, seen.turn)


@part
def _note_turns(turn: Any, seen: Any) -> None:
    if turn is None:
        return
    for h in range(turn.size):
        seen[h] = turn[h]


@part
def _mark_changed(world: World, pairs: Any, footing: Any, impulses: Any, sleep: Any) -> None:
    """Mark islands whose contacts with awake bottles have changed their force."""
    if pairs is None:
        return
    _sum_pairs(world.bottles, pairs, pairs.impulse, impulses, sleep)
    for i in range(world.bottles.id.size):
        limit = WAKING * (_friction(footing, i) + DEEP * sleep.press[i])
        if sleep.asleep[i] != 0 and abs(sleep.sum[i] - sleep.press[i]) > limit:
            sleep.mark[sleep.island[i]] = 1


@part
def _sum_pairs(bottles: Any, pairs: Any, held: Any, impulses: Any, sleep: Any) -> None:
    """Sum the magnitudes of the forces between bottles by bottle, N."""
    per_step = 1.0 / impulses.step[0] if impulses.step[0] > 0.0 else 0.0
    for i in range(bottles.id.size):
        sleep.sum[i] = 0.0
    for p in range(uint64(pairs.used[0])):
        x, y = held.row[uint64(ROW) * p], held.row[uint64(ROW) * p + uint64(1)]
        force = per_step * math.sqrt(x * x + y * y)
        sleep.sum[held.i[p]] += force
        sleep.sum[held.j[p]] += force


@part
def _friction(footing: Any, i: int) -> float:
    """Return the largest friction force under bottle i, N."""
    if footing is None:
        return 0.0
    return footing.friction_limit[i]


@part
def _count_quiet(world: World, impulses: Any, sleep: Any) -> bool:
    """Count the ticks for which each awake bottle has been quiet. Return True if one has reached TICKS or LONG."""
    bottles = world.bottles
    still = 0
    for i in range(uint64(bottles.id.size)):
        limit = min(SLOW, BALANCE * impulses.step[0] * _friction(world.footing, i) * bottles.inverse_mass[i])
        slow = abs(bottles.vx[i]) <= limit and abs(bottles.vy[i]) <= limit and _rim(bottles, world.spin, i) <= limit
        near = abs(bottles.x[i] - sleep.x[i]) < PLACE and abs(bottles.y[i] - sleep.y[i]) < PLACE
        stays = slow and near and bottles.id[i] >= 0 and not _near_a_body(world.near_bodies, i)
        sleep.mark[i] = stays
        still += stays and sleep.asleep[i] == 0
    if still > 0:
        _press(bottles, world.pairs, impulses, sleep)
    ready = 0
    for i in range(uint64(bottles.id.size)):
        if sleep.asleep[i] == 0:
            limit = CONSTANT * (_friction(world.footing, i) + DEEP * sleep.press[i])
            if sleep.mark[i] != 0 and abs(sleep.sum[i] - sleep.press[i]) <= limit:
                ready += sleep.quiet[i] == TICKS - 1 or sleep.quiet[i] == LONG - 1
                sleep.quiet[i] = min(sleep.quiet[i] + 1, LONG)
            else:
                sleep.quiet[i] = 0
            sleep.x[i] = bottles.x[i]
            sleep.y[i] = bottles.y[i]
            sleep.press[i] = sleep.sum[i]
    return ready > 0


@part
def _near_a_body(near: Any, i: int) -> bool:
    """Return True if bottle i is near the sweep of a body, whose drive bears it in every step."""
    if near is None:
        return False
    return near.start[i] < near.start[i + 1]


@part
def _press(bottles: Any, pairs: Any, impulses: Any, sleep: Any) -> None:
    if pairs is not None:
        _sum_pairs(bottles, pairs, pairs.impulse, impulses, sleep)


@part
def _rim(bottles: Any, spin: Any, i: int) -> float:
    """Return the speed of a bottle's wall about its axis, m/s."""
    if spin is None:
        return 0.0
    return abs(bottles.radius[i] * spin.omega[i])


@part
def _fall_asleep(world: World, impulses: Any, sleep: Any) -> bool:
    """Put islands and parts of islands to sleep that were quiet long enough. Return True if there were any."""
    bottles = world.bottles
    for i in range(bottles.id.size):
        sleep.noise[i] = 0
    _join(bottles, world.pairs, sleep, sleep.root, False)
    for i in range(bottles.id.size):
        if sleep.asleep[i] == 0 and sleep.quiet[i] < TICKS:
            sleep.noise[sleep.root[i]] = 1
    for i in range(bottles.id.size):
        whole = sleep.noise[sleep.root[i]] == 0
        sleep.mark[i] = sleep.asleep[i] == 0 and bottles.id[i] >= 0 and (whole or sleep.quiet[i] >= LONG)
    _keep_awake(world.pairs, sleep)
    fallen = 0
    for i in range(bottles.id.size):
        if sleep.mark[i] == 1:
            fallen += 1
            sleep.asleep[i] = 1
            sleep.id[i] = bottles.id[i]
            sleep.type[i] = bottles.type[i]
            bottles.vx[i] = bottles.vy[i] = 0.0
            _stop_turning(world.spin, i)
    if fallen == 0:
        return False
    sleep.sleepers[0] += fallen
    _join(bottles, world.pairs, sleep, sleep.island, True)
    return True


@part
def _keep_awake(pairs: Any, sleep: Any) -> None:
    """Mark candidates as 2 that touch an awake bottle which is none."""
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        i, j, row = pairs.i[p], pairs.j[p], ROW * pairs.impulse.place[p]
        if pairs.impulse.row[row] != 0.0 or pairs.impulse.row[row + 1] != 0.0:
            if sleep.mark[i] != 0 and sleep.mark[j] == 0 and sleep.asleep[j] == 0:
                sleep.mark[i] = 2
            if sleep.mark[j] != 0 and sleep.mark[i] == 0 and sleep.asleep[i] == 0:
                sleep.mark[j] = 2


@part
def _stop_turning(spin: Any, i: int) -> None:
    if spin is not None:
        spin.omega[i] = 0.0


@part
def _join(bottles: Any, pairs: Any, sleep: Any, island: Any, asleep: bool) -> None:
    """Find the islands of bottles that touch each other, named by their first slot. asleep: of sleepers only."""
    for i in range(bottles.id.size):
        island[i] = i
    if pairs is None:
        return
    held = pairs.impulse
    for p in range(uint64(pairs.used[0])):
        i, j = held.i[p], held.j[p]
        if held.row[uint64(ROW) * p] != 0.0 or held.row[uint64(ROW) * p + uint64(1)] != 0.0:
            if not asleep or (sleep.asleep[i] != 0 and sleep.asleep[j] != 0):
                a, b = _root(island, i), _root(island, j)
                island[max(a, b)] = min(a, b)
    for i in range(bottles.id.size):
        island[i] = _root(island, i)


@part
def _root(island: Any, i: int) -> int:
    while island[i] != i:
        island[i] = island[island[i]]
        i = island[i]
    return i


@part
def _hold_still(bottles: Any, body: Any, sleep: Any) -> None:
    """Write the rows of sleepers, which awake neighbours read: no velocity, and an infinite mass."""
    for i in range(bottles.id.size):
        if sleep.asleep[i] != 0:
            for number in range(BODY):
                body[BODY * i + number] = 0.0
            body[BODY * i] = bottles.x[i]
            body[BODY * i + 1] = bottles.y[i]
            body[BODY * i + 7] = bottles.radius[i]


@part
def _weigh(world: World, impulses: Any, sleep: Any, loads: Any) -> None:
    """Sum the normal forces of contacts between sleepers, and between sleepers and rails, by bottle."""
    if loads is None:
        return
    for i in range(world.bottles.id.size):
        loads.largest[i] = loads.total[i] = 0.0
    per_step = 1.0 / impulses.step[0] if impulses.step[0] > 0.0 else 0.0
    _weigh_pairs(world.bottles, world.pairs, sleep, loads, per_step)
    _weigh_segments(world, world.segments, world.near_segments, sleep, loads, per_step)
    _weigh_arcs(world, world.arcs, world.near_arcs, sleep, loads, per_step)


@part
def _weigh_pairs(bottles: Any, pairs: Any, sleep: Any, loads: Any, per_step: float) -> None:
    if pairs is None:
        return
    for p in range(pairs.used[0]):
        i, j, row = pairs.i[p], pairs.j[p], ROW * pairs.impulse.place[p]
        if sleep.asleep[i] != 0 and sleep.asleep[j] != 0:
            dx, dy = bottles.x[j] - bottles.x[i], bottles.y[j] - bottles.y[i]
            along = pairs.impulse.row[row] * dx + pairs.impulse.row[row + 1] * dy
            force = per_step * along / math.sqrt(dx * dx + dy * dy)
            _load(loads, i, force)
            _load(loads, j, force)


@part
def _weigh_segments(world: World, segments: Any, near: Any, sleep: Any, loads: Any, per_step: float) -> None:
    if segments is None:
        return
    bottles, margin = world.bottles, 0.5 * world.settings.skin
    for i in range(bottles.id.size):
        if sleep.asleep[i] != 0:
            for entry in range(near.start[i], near.start[i + 1]):
                piece, row = near.piece[entry], ROW * entry
                _, nx, ny = segment_contact(segments, piece, bottles.x[i], bottles.y[i], bottles.radius[i] + margin)
                _load(loads, i, per_step * (near.impulse.row[row] * nx + near.impulse.row[row + 1] * ny))


@part
def _weigh_arcs(world: World, arcs: Any, near: Any, sleep: Any, loads: Any, per_step: float) -> None:
    if arcs is None:
        return
    bottles, margin = world.bottles, 0.5 * world.settings.skin
    for i in range(bottles.id.size):
        if sleep.asleep[i] != 0:
            for entry in range(near.start[i], near.start[i + 1]):
                piece, row = near.piece[entry], ROW * entry
                _, nx, ny = arc_contact(arcs, piece, bottles.x[i], bottles.y[i], bottles.radius[i] + margin)
                _load(loads, i, per_step * (near.impulse.row[row] * nx + near.impulse.row[row + 1] * ny))


@part
def _load(loads: Any, i: int, force: float) -> None:
    if force > 0.0:
        loads.largest[i] = max(loads.largest[i], force)
        loads.total[i] += force


@part
def _book(peaks: Any, sleep: Any, loads: Any, tick: float) -> None:
    """Update the peaks of sleepers for a tick (s) of constant forces."""
    if peaks is None:
        return
    for i in range(sleep.asleep.size):
        if sleep.asleep[i] != 0:
            peaks.force[i] = max(peaks.force[i], loads.largest[i])
            peaks.impulse[i] += tick * loads.total[i]

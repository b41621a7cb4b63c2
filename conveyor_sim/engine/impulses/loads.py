# SPDX-License-Identifier: Apache-2.0
"""Loads on bottles and rails with the method of impulses; as `observers/damage.py` has them with forces.

A pressed contact is noted in the last sweep of a substep: its force is the impulse divided by the substep, and the
slip is that at the end. An impact is noted at its visit: its peak force and its speed are closed forms, and friction
works with the mean slip. Nothing here changes an impulse.
"""

from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.impulses import MOST_PRESSED, LoadScratch
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.observers.damage import raise_to, tip


@part
def begin_loads(world: World, impulses: Any, h: float, first: int, end: int) -> None:
    """Clear the loads of a substep of bottles first to end, and note the friction under them."""
    _clear(world, world.damage, impulses.loads, impulses.free, h, first, end)


@part
def _clear(world: World, damage: Any, loads: Any, free: F8, h: float, first: int, end: int) -> None:
    if loads is None:
        return
    for i in range(first, end):
        loads.normal[i] = loads.blow[i] = loads.x[i] = loads.y[i] = 0.0
        loads.pressed[i] = 0
    _note_base(world.bottles, damage.tipping, free, h, first, end)


@part
def _note_base(bottles: Bottles, tipping: Any, free: F8, h: float, first: int, end: int) -> None:
    if tipping is None:
        return
    for i in range(first, end):
        if bottles.inverse_mass[i] > 0.0:
            tipping.fx[i] = (free[4 * i] - bottles.vx[i]) / (h * bottles.inverse_mass[i])
            tipping.fy[i] = (free[4 * i + 1] - bottles.vy[i]) / (h * bottles.inverse_mass[i])


@part
def note_pressed(
    damage: Any,
    loads: LoadScratch,
    i: int,
    sign: float,
    x: float,
    y: float,
    nx: float,
    ny: float,
    normal: float,
    work: float,
    h: float,
) -> None:
    """Note a pressed contact of bottle i: sign times (x, y), N s, is its impulse on it, sign times n points inward.

    normal: N s. work: of friction, J.
    """
    _push(loads, i, sign * x, sign * y)
    loads.normal[i] += normal
    count = loads.pressed[i]
    if count < MOST_PRESSED:
        place = MOST_PRESSED * i + count
        loads.pressed_x[place] = sign * nx
        loads.pressed_y[place] = sign * ny
        loads.pressed_normal[place] = normal
        loads.pressed[i] = count + 1
    _scuff(damage.scuffing, i, work)
    _raise_force(damage.impacts, i, normal / h)


@part
def note_blow(
    damage: Any, loads: LoadScratch, i: int, x: float, y: float, speed: float, peak: float, work: float
) -> None:
    """Note an impact on bottle i with impulse (x, y), N s, at a closing speed (m/s), by peak force (N) and work (J)."""
    _push(loads, i, x, y)
    loads.blow[i] = max(loads.blow[i], peak)
    _scuff(damage.scuffing, i, work)
    _raise_force(damage.impacts, i, peak)
    _raise_speed(damage.impacts, i, speed)


@part
def _push(loads: LoadScratch, i: int, x: float, y: float) -> None:
    loads.x[i] += x
    loads.y[i] += y


@part
def _scuff(scuffing: Any, i: int, work: float) -> None:
    if scuffing is None:
        return
    scuffing.work[i] += work


@part
def _raise_force(impacts: Any, i: int, force: float) -> None:
    if impacts is None:
        return
    raise_to(impacts.force, i, force)


@part
def _raise_speed(impacts: Any, i: int, speed: float) -> None:
    if impacts is None:
        return
    raise_to(impacts.speed, i, speed)


@part
def end_loads(world: World, impulses: Any, h: float, first: int, end: int) -> None:
    """Update the maxima of bottles first to end by the loads of a substep of h (s)."""
    _end(world, world.damage, impulses.loads, h, first, end)


@part
def _end(world: World, damage: Any, loads: Any, h: float, first: int, end: int) -> None:
    if loads is None:
        return
    for i in range(first, end):
        if world.bottles.id[i] >= 0:
            _crush(damage.crushing, loads, i, h)
            _tip(world.bottles, damage.tipping, loads, i, h)


@part
def _crush(crushing: Any, loads: LoadScratch, i: int, h: float) -> None:
    """Update the sum of normal forces, and the largest squeeze by two pressed contacts.

    An impact adds its peak to the sum. Two impacts in a substep follow each other.
    """
    if crushing is None:
        return
    raise_to(crushing.total, i, loads.normal[i] / h + loads.blow[i])
    opposed, begin = 0.0, MOST_PRESSED * i
    for a in range(begin, begin + loads.pressed[i]):
        for b in range(begin, a):
            cosine = loads.pressed_x[a] * loads.pressed_x[b] + loads.pressed_y[a] * loads.pressed_y[b]
            opposed = max(opposed, -cosine * min(loads.pressed_normal[a], loads.pressed_normal[b]))
    raise_to(crushing.opposed, i, opposed / h)


@part
def _tip(bottles: Bottles, tipping: Any, loads: LoadScratch, i: int, h: float) -> None:
    if tipping is None:
        return
    tip(i, bottles, tipping, loads.x[i] / h, loads.y[i] / h, h)

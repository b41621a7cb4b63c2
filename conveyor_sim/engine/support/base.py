"""Friction between a bottle's base and the belt or floor under it, N = m g (paper eqs. 7, 15).

The base is a point at the axis, the paper's, or a ring (`ring.py`). Bottles whose belt is certain go through one loop
without branches; a ring that may stand on several belts is summed point by point.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, Load
from conveyor_sim.engine.arrays.world import Settings
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import implicit_regularisation, regularisation
from conveyor_sim.engine.support.ring import ring_means, ring_share, straddling_ring
from conveyor_sim.engine.threads.workers import units


@part
def add_base_friction(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    load: Load,
    belts: Any,
    surface: Any,
    footing: Any,
    ring: Any,
    implicit: Any,
    powers: Any,
    dt: float,
    first: int,
    end: int,
) -> None:
    """Add the friction of belts and floor to `load` and `spin.moment` of bottles first to end.

    powers: (units, H + 1), W, to which what straddling rings take from each belt is added, or None.
    """
    if footing is None:
        return
    if ring is None:
        _point_friction(settings, settings.atan, bottles, load, footing, footing.turn, implicit, dt, first, end)
    if ring is not None:
        _ring_friction(
            settings, settings.atan, bottles, spin, load, footing, footing.turn, ring, implicit, dt, first, end
        )
        _straddling(settings, bottles, spin, load, belts, surface, ring, powers, settings.lag * dt, first, end)


@part
def relative_velocity(bottles: Bottles, footing: Any, turn: Any, lag: float, i: int) -> tuple[float, float]:
    """Velocity of the axis relative to the belt, m/s; where the axis was when it had this velocity, lag seconds ago."""
    vx = bottles.vx[i] - footing.ux[i]
    vy = bottles.vy[i] - footing.uy[i]
    if turn is not None:
        vx += turn[i] * (bottles.y[i] - lag * bottles.vy[i])
        vy -= turn[i] * (bottles.x[i] - lag * bottles.vx[i])
    return vx, vy


@part
def _point_friction(
    settings: Settings,
    atan: Any,
    bottles: Bottles,
    load: Load,
    footing: Any,
    turn: Any,
    implicit: Any,
    dt: float,
    first: int,
    end: int,
) -> None:
    for i in range(uint64(first), uint64(end)):
        vx, vy = relative_velocity(bottles, footing, turn, settings.lag * dt, i)
        pull = footing.friction_limit[i] * _quotient(
            settings, atan, bottles, footing, implicit, dt, i, math.sqrt(vx * vx + vy * vy)
        )
        load.fx[i] -= pull * vx
        load.fy[i] -= pull * vy


@part
def _quotient(
    settings: Settings, atan: Any, bottles: Bottles, footing: Any, implicit: Any, dt: float, i: int, speed: float
) -> float:
    if implicit is None:
        return regularisation(speed, settings.slip_limit, atan)
    ahead = settings.ahead * dt
    b = (
        ahead * footing.friction_limit[i] * bottles.inverse_mass[i] * implicit.closed[i] / settings.slip_limit
        - settings.at_once
    )
    return implicit_regularisation(speed, 0.0 if b < 0.0 else b, settings.slip_limit, atan)


@part
def _ring_friction(
    settings: Settings,
    atan: Any,
    bottles: Bottles,
    spin: Any,
    load: Load,
    footing: Any,
    turn: Any,
    ring: Any,
    implicit: Any,
    dt: float,
    begin: int,
    end: int,
) -> None:
    """A bottle with a base radius of 0 stands on a point beside others on rings."""
    for i in range(uint64(begin), uint64(end)):
        vx, vy = relative_velocity(bottles, footing, turn, settings.lag * dt, i)
        turning = spin.omega[i] - _turn(turn, i)
        rim = abs(turning) * ring.radius[i]
        slide = math.sqrt(vx * vx + vy * vy)
        limit, first, rest = ring_means(slide, rim, settings.slip_limit)
        point = _quotient(settings, atan, bottles, footing, implicit, dt, i, slide)
        pull = footing.friction_limit[i] * (
            ring_share(slide, rim, limit, first, rest) if ring.radius[i] > 0.0 else point
        )
        twist = footing.friction_limit[i] * ring_share(rim, slide, limit, first, rest)
        load.fx[i] -= pull * vx
        load.fy[i] -= pull * vy
        spin.moment[i] -= twist * ring.radius[i] * ring.radius[i] * turning


@part
def _turn(turn: Any, i: int) -> float:
    if turn is None:
        return 0.0
    return turn[i]


@part
def _straddling(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    load: Load,
    belts: Any,
    surface: Any,
    ring: Any,
    powers: Any,
    lag: float,
    first: int,
    end: int,
) -> None:
    if belts is None:
        return
    begin, stop = units(first, end)
    for entry in range(belts.uncertain.first[begin], belts.uncertain.first[stop]):
        i = belts.uncertain.bottle[entry]
        if ring.radius[i] == 0.0:
            continue
        fx, fy, moment = straddling_ring(
            i,
            belts,
            surface,
            surface.ux.size - 1,
            bottles.x[i],
            bottles.y[i],
            bottles.vx[i],
            bottles.vy[i],
            spin.omega[i],
            ring.radius[i],
            bottles.weight[i],
            bottles.type[i],
            settings.slip_limit,
            lag,
            powers,
        )
        load.fx[i] += fx
        load.fy[i] += fy
        spin.moment[i] += moment

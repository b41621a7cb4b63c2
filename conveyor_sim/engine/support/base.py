# SPDX-License-Identifier: Apache-2.0
"""Friction between a bottle's base and the belt or floor under it, N = m g (paper eqs. 7, 15).

The base is a point at the axis, as in the paper, or a ring (`ring.py`). Bottles whose belt is certain go through one
loop without branches; a ring that may straddle belts is summed point by point.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import implicit_regularisation, regularisation
from conveyor_sim.engine.support.ring import ring_means, ring_share, straddling_ring
from conveyor_sim.engine.threads.workers import units


@part
def add_base_friction(
    world: World, spin: Any, load: ForceSums, implicit: Any, dt: float, spring_dt: float, first: int, end: int
) -> None:
    """Add the friction of belts and floor to the load and moment of bottles first to end.

    Rings that may straddle belts are excluded (`add_straddling_friction`).
    spin, load, implicit: groups of the World, or other arrays of the same shape; implicit None: explicit friction.
    dt: step, s. spring_dt: as in `pair_phase`; 0 in the first evaluation of a tick by velocity Verlet.
    """
    if world.footing is None:
        return
    if world.ring is None:
        _point_friction(world, load, implicit, dt, spring_dt, first, end)
    if world.ring is not None:
        _ring_friction(world, spin, load, implicit, dt, spring_dt, first, end)


@part
def relative_velocity(bottles: Bottles, footing: Any, turn: Any, lag: float, i: int) -> tuple[float, float]:
    """Return the velocity of the axis relative to the belt, m/s, at the axis's position lag seconds ago."""
    vx = bottles.vx[i] - footing.ux[i]
    vy = bottles.vy[i] - footing.uy[i]
    if turn is not None:
        vx += turn[i] * (bottles.y[i] - lag * bottles.vy[i])
        vy -= turn[i] * (bottles.x[i] - lag * bottles.vx[i])
    return vx, vy


@part
def _point_friction(
    world: World, load: ForceSums, implicit: Any, dt: float, spring_dt: float, first: int, end: int
) -> None:
    bottles, footing = world.bottles, world.footing
    for i in range(uint64(first), uint64(end)):
        lead = _lead(world, implicit, dt, i)
        vx, vy = relative_velocity(bottles, footing, footing.turn, _lag(world, implicit, lead) * dt, i)
        pull, vx, vy = _point_pull(world, load, implicit, dt, spring_dt, lead, i, vx, vy)
        load.fx[i] -= pull * vx
        load.fy[i] -= pull * vy


@part
def _point_pull(
    world: World, load: ForceSums, implicit: Any, dt: float, spring_dt: float, lead: float, i: int, vx: float, vy: float
) -> tuple[float, float, float]:
    """Return friction over slip (kg/s) of a bottle on a point, and the slip (m/s) from which it is computed."""
    ahead = _ahead(world.stage, spring_dt, lead)
    vx, vy = _kicked(world, load, implicit, ahead * dt, lead, i, vx, vy)
    quotient = _quotient(world, implicit, dt, ahead, i, math.sqrt(vx * vx + vy * vy))
    return world.footing.friction_limit[i] * quotient, vx, vy


@part
def _lead(world: World, implicit: Any, dt: float, i: int) -> float:
    """Return the part of a step after which the slip on the base is evaluated, if other forces are known; else 0.

    Half a step is of second order. Up to gamma dt = 2 the slip does not reverse then; in longer steps 1 - 1/(gamma dt)
    keeps that. gamma is the rate at which small slips decay, twice the quotient of friction limit, mass and v_lim.
    """
    if implicit is None:
        return 0.0
    if world.settings.warm is None:
        return 0.0
    b = dt * world.footing.friction_limit[i] * world.bottles.inverse_mass[i] / world.settings.slip_limit
    return max(0.5, 1.0 - 1.0 / max(1.0, 2.0 * b))


@part
def _lag(world: World, implicit: Any, lead: float) -> float:
    """Return steps by which the slip on a belt is older than positions, negative if it is newer.

    Velocities are half a step older than positions with leapfrog and, for implicit friction that leads, with
    semi-implicit Euler. With velocity Verlet the slip is that at the end of the step for any lead.
    """
    if implicit is None:
        return world.settings.lag
    if world.settings.warm is None:
        return world.settings.lag
    if world.stage is None:
        return 0.5 - lead
    return 0.0


@part
def _ahead(stage: Any, spring_dt: float, lead: float) -> float:
    """Return steps for which forces act between the known velocity and the slip that is evaluated.

    In the first evaluation of a tick by velocity Verlet the velocity at the present positions is known, which in all
    others is that of mid-step. So the force of the last evaluation is repeated, up to gamma dt = 2.
    """
    if stage is None:
        return lead
    if spring_dt == 0.0:
        return lead - 0.5
    return lead


@part
def _kicked(
    world: World, load: ForceSums, implicit: Any, ahead: float, lead: float, i: int, vx: float, vy: float
) -> tuple[float, float]:
    """Return the velocity (m/s) after other forces have acted for `ahead` (s), from which implicit friction starts."""
    if implicit is None:
        return vx, vy
    if world.settings.warm is None:
        return vx, vy
    vx, vy = _unpredicted(world.bottles, world.stage, lead, i, vx, vy)
    ahead = ahead * world.bottles.inverse_mass[i]
    return vx + ahead * load.fx[i], vy + ahead * load.fy[i]


@part
def _unpredicted(bottles: Bottles, stage: Any, lead: float, i: int, vx: float, vy: float) -> tuple[float, float]:
    """Return the velocity to which a force of `lead` steps is added, from that predicted for the end of the step.

    With velocity Verlet it is that of mid-step for a lead of half a step, and that of the start for a whole one.
    """
    if stage is None:
        return vx, vy
    return vx + 2.0 * lead * (stage.vx[i] - bottles.vx[i]), vy + 2.0 * lead * (stage.vy[i] - bottles.vy[i])


@part
def _split(warm: Any, implicit: Any, ahead: float, i: int) -> float:
    """Return the factor of b: the contacts among which the mass is split or, if other forces are known, the lead."""
    if warm is None:
        return float(implicit.closed[i])
    return ahead


@part
def _quotient(world: World, implicit: Any, dt: float, ahead: float, i: int, speed: float) -> float:
    settings = world.settings
    if implicit is None:
        return regularisation(speed, settings.slip_limit, settings.atan)
    limit, closed = world.footing.friction_limit[i], _split(settings.warm, implicit, ahead, i)
    b = settings.ahead * dt * limit * world.bottles.inverse_mass[i] * closed / settings.slip_limit - settings.at_once
    return implicit_regularisation(speed, 0.0 if b < 0.0 else b, settings.slip_limit, settings.atan)


@part
def _ring_friction(
    world: World, spin: Any, load: ForceSums, implicit: Any, dt: float, spring_dt: float, begin: int, end: int
) -> None:
    """Add ring friction. A bottle with a base radius of 0, beside others with rings, stands on a point."""
    bottles, footing, ring, settings = world.bottles, world.footing, world.ring, world.settings
    for i in range(uint64(begin), uint64(end)):
        vx, vy = relative_velocity(bottles, footing, footing.turn, settings.lag * dt, i)
        turning = spin.omega[i] - _turn(footing.turn, i)
        rim = abs(turning) * ring.radius[i]
        slide = math.sqrt(vx * vx + vy * vy)
        limit, first, rest = ring_means(slide, rim, settings.slip_limit)
        lead = _lead(world, implicit, dt, i)
        point_x, point_y = relative_velocity(bottles, footing, footing.turn, _lag(world, implicit, lead) * dt, i)
        point, point_x, point_y = _point_pull(world, load, implicit, dt, spring_dt, lead, i, point_x, point_y)
        vx, vy = (vx, vy) if ring.radius[i] > 0.0 else (point_x, point_y)
        pull = footing.friction_limit[i] * ring_share(slide, rim, limit, first, rest) if ring.radius[i] > 0.0 else point
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
def add_straddling_friction(
    world: World, spin: Any, load: ForceSums, powers: Any, lag: float, first: int, end: int
) -> None:
    """Add the friction on rings that may straddle belts to the load of bottles first to end.

    `first` must be a multiple of UNIT.
    powers: (units, H + 1), W, to which the power taken from each belt is added, or None. lag: s, as in
    `relative_velocity`.
    """
    bottles, belts = world.bottles, world.belts
    if belts is None:
        return
    if world.ring is None:
        return
    begin, stop = units(first, end)
    for entry in range(belts.uncertain.first[begin], belts.uncertain.first[stop]):
        i = belts.uncertain.bottle[entry]
        if world.ring.radius[i] == 0.0:
            continue
        fx, fy, moment = straddling_ring(i, world, bottles.vx[i], bottles.vy[i], spin.omega[i], lag, powers)
        load.fx[i] += fx
        load.fy[i] += fy
        spin.moment[i] += moment

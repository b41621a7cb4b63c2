# SPDX-License-Identifier: Apache-2.0
"""Friction under the bottles in the linearly implicit method: its resistance to a change of velocity (`tangent.py`)."""

import math

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import regularisation
from conveyor_sim.engine.integrators.tangent import DIFFERENCE, firmness, resistance
from conveyor_sim.engine.support.base import relative_velocity
from conveyor_sim.engine.support.ring import ring_means, ring_share, straddling_ring
from conveyor_sim.engine.threads.workers import units


@part
def resist_base(world: World, dt: float, theta: float, first: int, end: int) -> None:
    """Add the resistance of base friction, kg, to the blocks of bottles first to end. `footing` must be current."""
    ring = world.ring
    if world.footing is None:
        return
    if ring is None:
        for i in range(first, end):
            _resist_point(world, dt, theta, i)
    if ring is not None:
        for i in range(first, end):
            if ring.radius[i] > 0.0:
                _resist_ring(world, dt, theta, i)
            else:
                _resist_point(world, dt, theta, i)
        _resist_straddling(world, dt, theta, first, end)


@part
def _resist_point(world: World, dt: float, theta: float, i: int) -> None:
    settings, bottles, footing, own = world.settings, world.bottles, world.footing, world.linear.own
    vx, vy = relative_velocity(bottles, footing, footing.turn, 0.0, i)
    least = DIFFERENCE * settings.slip_limit
    speed = math.sqrt(vx * vx + vy * vy)
    far = speed if speed > least else least
    faster = far + least
    quotient = regularisation(far, settings.slip_limit, settings.atan)
    limit = dt * footing.friction_limit[i]
    secant = limit * quotient
    slope = limit * (faster * regularisation(faster, settings.slip_limit, settings.atan) - far * quotient) / least
    along = resistance(slope, secant, theta, 2.0 * bottles.inverse_mass[i])
    across = resistance(secant, secant, theta, 2.0 * bottles.inverse_mass[i])
    nx, ny = (vx / far, vy / far) if speed > least else (1.0, 0.0)
    own.xx[i] += along * nx * nx + across * ny * ny
    own.xy[i] += (along - across) * nx * ny
    own.yy[i] += along * ny * ny + across * nx * nx


@part
def _resist_ring(world: World, dt: float, theta: float, i: int) -> None:
    settings, bottles, spin, own = world.settings, world.bottles, world.spin, world.linear.own
    footing, ring = world.footing, world.ring
    vx, vy = relative_velocity(bottles, footing, footing.turn, 0.0, i)
    turn = footing.turn
    turning = spin.omega[i] - turn[i] if turn is not None else spin.omega[i]
    least = DIFFERENCE * settings.slip_limit
    speed, rim, radius = math.sqrt(vx * vx + vy * vy), abs(turning) * ring.radius[i], ring.radius[i]
    slide, spinning = max(speed, least), max(rim, least)
    force, twist = _ring_forces(slide, spinning, settings.slip_limit)
    force_faster, twist_faster = _ring_forces(slide + least, spinning, settings.slip_limit)
    _, twist_spun = _ring_forces(slide, spinning + least, settings.slip_limit)
    limit = dt * footing.friction_limit[i]
    secant, secant_turn = limit * force / slide, limit * twist / spinning
    turns = max(secant * bottles.inverse_mass[i], secant_turn * radius * radius * spin.inverse_inertia[i])
    turned = firmness(2.0 * turns)
    slope = theta * (1.0 - turned) * limit / least
    along = slope * (force_faster - force) + turned * secant
    across = theta * secant + turned * (1.0 - theta) * secant
    both = slope * (twist_faster - twist) * (radius if turning > 0.0 else -radius)
    nx, ny = (vx / slide, vy / slide) if speed > least else (1.0, 0.0)
    own.xx[i] += along * nx * nx + across * ny * ny
    own.xy[i] += (along - across) * nx * ny
    own.yy[i] += along * ny * ny + across * nx * nx
    own.xt[i] += both * nx
    own.yt[i] += both * ny
    own.tt[i] += (slope * (twist_spun - twist) + turned * secant_turn) * radius * radius


@part
def _ring_forces(slide: float, rim: float, slip_limit: float) -> tuple[float, float]:
    """Return F/(mu m g) and M/(mu m g R_b) of a ring that slides and spins at speeds greater than 0, m/s."""
    limit, first, rest = ring_means(slide, rim, slip_limit)
    return slide * ring_share(slide, rim, limit, first, rest), rim * ring_share(rim, slide, limit, first, rest)


@part
def _resist_straddling(world: World, dt: float, theta: float, first: int, end: int) -> None:
    """Add the resistance of rings that may straddle belts; the secant is that of the belt under the axis alone."""
    settings, bottles, belts, footing = world.settings, world.bottles, world.belts, world.footing
    own = world.linear.own
    if belts is None:
        return
    begin, stop = units(first, end)
    for entry in range(belts.uncertain.first[begin], belts.uncertain.first[stop]):
        i = belts.uncertain.bottle[entry]
        radius = world.ring.radius[i]
        if radius == 0.0:
            continue
        step = DIFFERENCE * settings.slip_limit
        fx, fy, moment = _straddled(world, i, 0.0, 0.0, 0.0)
        fx_x, fy_x, moment_x = _straddled(world, i, step, 0.0, 0.0)
        _, fy_y, moment_y = _straddled(world, i, 0.0, step, 0.0)
        _, _, moment_t = _straddled(world, i, 0.0, 0.0, step / radius)
        vx, vy = relative_velocity(bottles, footing, footing.turn, 0.0, i)
        limit = dt * world.surface.friction[footing.carrier[i], bottles.type[i]] * bottles.weight[i]
        secant = limit * regularisation(math.sqrt(vx * vx + vy * vy), settings.slip_limit, None)
        turned = firmness(2.0 * secant * bottles.inverse_mass[i])
        slope = theta * (1.0 - turned) * dt / step
        own.xx[i] += slope * (fx - fx_x) + turned * secant
        own.xy[i] += slope * (fy - fy_x)
        own.yy[i] += slope * (fy - fy_y) + turned * secant
        own.xt[i] += slope * (moment - moment_x)
        own.yt[i] += slope * (moment - moment_y)
        own.tt[i] += (slope * (moment - moment_t) / radius + turned * secant * radius) * radius


@part
def _straddled(world: World, i: int, dvx: float, dvy: float, domega: float) -> tuple[float, float, float]:
    vx, vy, omega = world.bottles.vx[i] + dvx, world.bottles.vy[i] + dvy, world.spin.omega[i] + domega
    return straddling_ring(i, world, vx, vy, omega, 0.0, None)

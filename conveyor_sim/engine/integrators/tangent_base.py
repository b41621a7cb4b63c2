"""Friction under the bottles for the linearly implicit method: how it resists a change of velocity (`tangent.py`)."""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.integrators import Blocks
from conveyor_sim.engine.arrays.world import Settings
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import regularisation
from conveyor_sim.engine.integrators.tangent import DIFFERENCE, firmness, resistance
from conveyor_sim.engine.support.base import relative_velocity
from conveyor_sim.engine.support.ring import ring_means, ring_share, straddling_ring
from conveyor_sim.engine.threads.workers import units


@part
def resist_base(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    own: Blocks,
    belts: Any,
    surface: Any,
    footing: Any,
    ring: Any,
    dt: float,
    theta: float,
    first: int,
    end: int,
) -> None:
    """Add to the blocks of bottles first to end how the base friction resists, kg; `footing` must be that of now."""
    if footing is None:
        return
    if ring is None:
        for i in range(first, end):
            _resist_point(settings, settings.atan, bottles, own, footing, footing.turn, dt, theta, i)
    if ring is not None:
        for i in range(first, end):
            if ring.radius[i] > 0.0:
                _resist_ring(settings, bottles, spin, own, footing, footing.turn, ring, dt, theta, i)
            else:
                _resist_point(settings, settings.atan, bottles, own, footing, footing.turn, dt, theta, i)
        _resist_straddling(settings, bottles, spin, own, belts, surface, footing, ring, dt, theta, first, end)


@part
def _resist_point(
    settings: Settings,
    atan: Any,
    bottles: Bottles,
    own: Blocks,
    footing: Any,
    turn: Any,
    dt: float,
    theta: float,
    i: int,
) -> None:
    vx, vy = relative_velocity(bottles, footing, turn, 0.0, i)
    least = DIFFERENCE * settings.slip_limit
    speed = math.sqrt(vx * vx + vy * vy)
    far = speed if speed > least else least
    faster = far + least
    quotient = regularisation(far, settings.slip_limit, atan)
    limit = dt * footing.friction_limit[i]
    secant = limit * quotient
    slope = limit * (faster * regularisation(faster, settings.slip_limit, atan) - far * quotient) / least
    along = resistance(slope, secant, theta, 2.0 * bottles.inverse_mass[i])
    across = resistance(secant, secant, theta, 2.0 * bottles.inverse_mass[i])
    nx, ny = (vx / far, vy / far) if speed > least else (1.0, 0.0)
    own.xx[i] += along * nx * nx + across * ny * ny
    own.xy[i] += (along - across) * nx * ny
    own.yy[i] += along * ny * ny + across * nx * nx


@part
def _resist_ring(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    own: Blocks,
    footing: Any,
    turn: Any,
    ring: Any,
    dt: float,
    theta: float,
    i: int,
) -> None:
    vx, vy = relative_velocity(bottles, footing, turn, 0.0, i)
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
    """F/(mu m g) and M/(mu m g R_b) of a ring that slides and spins at speeds greater than 0, m/s."""
    limit, first, rest = ring_means(slide, rim, slip_limit)
    return slide * ring_share(slide, rim, limit, first, rest), rim * ring_share(rim, slide, limit, first, rest)


@part
def _resist_straddling(
    settings: Settings,
    bottles: Bottles,
    spin: Any,
    own: Blocks,
    belts: Any,
    surface: Any,
    footing: Any,
    ring: Any,
    dt: float,
    theta: float,
    first: int,
    end: int,
) -> None:
    """Rings that may stand on several belts; their secant is taken as if all stood on the belt under the axis."""
    if belts is None:
        return
    begin, stop = units(first, end)
    for entry in range(belts.uncertain.first[begin], belts.uncertain.first[stop]):
        i = belts.uncertain.bottle[entry]
        radius = ring.radius[i]
        if radius == 0.0:
            continue
        step = DIFFERENCE * settings.slip_limit
        fx, fy, moment = _straddled(settings, bottles, belts, surface, ring, spin, i, 0.0, 0.0, 0.0)
        fx_x, fy_x, moment_x = _straddled(settings, bottles, belts, surface, ring, spin, i, step, 0.0, 0.0)
        _, fy_y, moment_y = _straddled(settings, bottles, belts, surface, ring, spin, i, 0.0, step, 0.0)
        _, _, moment_t = _straddled(settings, bottles, belts, surface, ring, spin, i, 0.0, 0.0, step / radius)
        vx, vy = relative_velocity(bottles, footing, footing.turn, 0.0, i)
        limit = dt * surface.friction[footing.carrier[i], bottles.type[i]] * bottles.weight[i]
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
def _straddled(
    settings: Settings,
    bottles: Bottles,
    belts: Any,
    surface: Any,
    ring: Any,
    spin: Any,
    i: int,
    dvx: float,
    dvy: float,
    domega: float,
) -> tuple[float, float, float]:
    return straddling_ring(
        i,
        belts,
        surface,
        surface.ux.size - 1,
        bottles.x[i],
        bottles.y[i],
        bottles.vx[i] + dvx,
        bottles.vy[i] + dvy,
        spin.omega[i] + domega,
        ring.radius[i],
        bottles.weight[i],
        bottles.type[i],
        settings.slip_limit,
        0.0,
        None,
    )

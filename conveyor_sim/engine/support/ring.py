# SPDX-License-Identifier: Apache-2.0
"""Friction of a base that is a ring, shared by sliding and spinning. The paper's base is a point.

For a disc: Farkas, Bartels, Unger and Wolf, Phys. Rev. Lett. 90, 248302 (2003).

Every point of the ring drags with its share of mu m g along its own slip v, smoothed to v/sqrt(v^2 + eps^2) with eps =
v_lim/2: the slope at rest, 2/v_lim, is that of the regularised point. A ring that also spins slides more easily, and
its spin slows down.
"""

import math
from typing import Any

import numpy as np

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.support.belts import carrier, surface_velocity
from conveyor_sim.engine.threads.workers import UNIT

POINTS = 32
"""Points of a ring that may straddle belts."""
HALVINGS = 6
"""Bisections for the edge between two points. The force is then accurate to 0.2 % of mu m g rms, 2 % at most."""

_ANGLES = 2.0 * np.pi * np.arange(POINTS) / POINTS
_COS, _SIN = np.cos(_ANGLES), np.sin(_ANGLES)


@part
def ring_means(slide: float, spin: float, slip_limit: float) -> tuple[float, float, float]:
    """Return (limit, first, rest) of a ring on one belt for `ring_share`, m/s, m/s, m^2/s^2.

    slide: s_v >= 0, m/s, speed of the axis relative to the belt. spin: s_w = |omega| R_b >= 0, m/s, relative as well.

    The mean over the ring consists of complete elliptic integrals: the limit of the arithmetic-geometric mean that
    starts from S = sqrt((s_v + s_w)^2 + eps^2) and D = sqrt((s_v - s_w)^2 + eps^2), its first arithmetic mean, and
    sum_(n > 1) 2^(n-2) c_n^2 with c_n half the difference before round n. Six rounds suffice for D/S down to 1e-6.
    """
    squared = 0.25 * slip_limit * slip_limit
    sum_squared = (slide + spin) * (slide + spin) + squared
    difference_squared = (slide - spin) * (slide - spin) + squared
    # D is computed from S. LLVM would put two independent roots of one bottle into one vector instruction, and then
    # could not vectorise across bottles.
    unit = 1.0 / math.sqrt(sum_squared)
    ratio = math.sqrt(difference_squared * unit * unit)
    a = first = 0.5 * (1.0 + ratio)
    b = math.sqrt(ratio)
    rest = 0.0
    a, b, rest = _mean(a, b, rest, 1.0)
    a, b, rest = _mean(a, b, rest, 2.0)
    a, b, rest = _mean(a, b, rest, 4.0)
    a, b, rest = _mean(a, b, rest, 8.0)
    a, b, rest = _mean(a, b, rest, 16.0)
    scale = sum_squared * unit
    return scale * a, scale * first, sum_squared * rest


@part
def _mean(a: float, b: float, rest: float, weight: float) -> tuple[float, float, float]:
    """Return the two means of one round, and `rest` plus weight times the square of half the difference."""
    c = 0.5 * (a - b)
    return 0.5 * (a + b), math.sqrt(a * b), rest + weight * c * c


@part
def ring_share(own: float, other: float, limit: float, first: float, rest: float) -> float:
    """Return the share of friction per slip speed, s/m; finite.

    With own = s_v and other = s_w it is F/(mu m g s_v). With own = s_w and other = s_v it is M/(mu m g R_b s_w). The
    formula [1 - (s_w/first)^2/2 - rest/s_v^2]/limit is free of cancellation; c_1 = s_v s_w/first is in its second term.
    """
    # `rest` scales with the fourth power of the smaller speed: far below the other speed it is only rounding error.
    least = 1e-8 * first
    own = least if least > own else own
    inverse = 1.0 / (own * first * limit)
    turned = other * own * limit * inverse
    slowed = first * limit * inverse
    return (1.0 - 0.5 * turned * turned - rest * slowed * slowed) * (own * first * inverse)


@part
def straddling_ring(
    i: int, world: World, vx: float, vy: float, omega: float, lag: float, powers: Any
) -> tuple[float, float, float]:
    """Return force (N, x and y) and moment about the axis (N m) on a ring whose points may be on different belts.

    i: the bottle, whose candidate belts are listed. vx, vy: m/s, omega: rad/s, of its axis. lag: s, as in
    `relative_velocity`. powers: (units, H + 1), W, to which the power of each belt is added; or None.
    """
    bottles, belts, surface, slip_limit = world.bottles, world.belts, world.surface, world.settings.slip_limit
    x, y, radius, weight, kind = bottles.x[i], bottles.y[i], world.ring.radius[i], bottles.weight[i], bottles.type[i]
    floor = surface.ux.size - 1
    squared = 0.25 * slip_limit * slip_limit
    fx = fy = moment = 0.0
    last_x, last_y = x + radius * _COS[POINTS - 1], y + radius * _SIN[POINTS - 1]
    here_x, here_y = x + radius, y
    here = carrier(i, belts, floor, here_x, here_y)
    before = _extent(i, belts, floor, last_x, last_y, carrier(i, belts, floor, last_x, last_y), here_x, here_y, here)
    for k in range(POINTS):
        next_x, next_y = x + radius * _COS[(k + 1) % POINTS], y + radius * _SIN[(k + 1) % POINTS]
        there = carrier(i, belts, floor, next_x, next_y)
        after = _extent(i, belts, floor, here_x, here_y, here, next_x, next_y, there)
        ux, uy = surface_velocity(here, here_x - lag * vx, here_y - lag * vy, surface, surface.turn)
        arm_x, arm_y = here_x - x, here_y - y
        slip_x = vx - omega * arm_y - ux
        slip_y = vy + omega * arm_x - uy
        pull = surface.friction[here, kind] * (after + 1.0 - before)
        pull /= math.sqrt(slip_x * slip_x + slip_y * slip_y + squared)
        fx -= pull * slip_x
        fy -= pull * slip_y
        moment -= pull * (arm_x * slip_y - arm_y * slip_x)
        _add_power(powers, i // UNIT, here, -weight / POINTS * pull * (slip_x * ux + slip_y * uy))
        here_x, here_y, here, before = next_x, next_y, there, after
    share = weight / POINTS
    return share * fx, share * fy, share * moment


@part
def _add_power(powers: Any, unit: int, h: int, power: float) -> None:
    if powers is not None:
        powers[unit, h] += power


@part
def _extent(
    i: int,
    belts: Any,
    floor: int,
    here_x: float,
    here_y: float,
    here: int,
    next_x: float,
    next_y: float,
    there: int,
) -> float:
    """Return the share of the arc between two points that counts as the first one's: half, or up to its belt's edge."""
    if here == there:
        return 0.5
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        x, y = here_x + middle * (next_x - here_x), here_y + middle * (next_y - here_y)
        if carrier(i, belts, floor, x, y) == here:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

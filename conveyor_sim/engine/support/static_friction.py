# SPDX-License-Identifier: Apache-2.0
"""Static friction with memory: a spring from each base to a point of its belt (Cundall and Strack 1979).

The point, the anchor, moves with the belt's surface, so on a turning belt the spring turns with it. The spring pulls
with k e + c v, at most mu m g; e from the anchor to the axis, v the velocity relative to the belt. At an
elongation of mu m g / k, the base slides and drags the anchor along. On another belt a new spring starts without load.

Anchors are stored, not elongations, so the length of a spring is exact for any integrator.
"""

import math
from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles, ForceSums
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.support.base import relative_velocity


@part
def add_static_friction(
    bottles: Bottles, load: ForceSums, footing: Any, static: Any, lag: float, drags: bool, first: int, end: int
) -> None:
    """Add the pull of the springs to `load` of bottles first to end; `footing` must be up to date.

    lag: s, as in `relative_velocity`. drags: create missing anchors, and drag those of sliding bases; False to compute
    forces only.
    """
    if static is None:
        return
    for i in range(uint64(first), uint64(end)):
        h = footing.carrier[i]
        entry = uint64(h) * uint64(static.types) + uint64(bottles.type[i])
        stiffness, most = static.stiffness[entry], static.friction[entry] * bottles.weight[i]
        tied = static.belt[i] == h
        ex = bottles.x[i] - static.x[i] if tied else 0.0
        ey = bottles.y[i] - static.y[i] if tied else 0.0
        drawn = stiffness * math.sqrt(ex * ex + ey * ey)
        kept = most / drawn if drawn > most else 1.0
        ex *= kept
        ey *= kept
        vx, vy = relative_velocity(bottles, footing, footing.turn, lag, i)
        fx = stiffness * ex + static.damping[entry] * vx
        fy = stiffness * ey + static.damping[entry] * vy
        total = math.sqrt(fx * fx + fy * fy)
        held = most / total if total > most else 1.0
        load.fx[i] -= held * fx
        load.fy[i] -= held * fy
        if drags:
            stays = tied and kept == 1.0
            static.x[i] = static.x[i] if stays else bottles.x[i] - ex
            static.y[i] = static.y[i] if stays else bottles.y[i] - ey
            static.belt[i] = h


@part
def carry_anchors(footing: Any, vibration: Any, static: Any, dt: float, first: int, end: int) -> None:
    """Move the anchors of bottles first to end with their belts for dt seconds."""
    if static is None:
        return
    for i in range(uint64(first), uint64(end)):
        dx, dy = _carried(footing, vibration, static, dt, i)
        static.x[i] += dx
        static.y[i] += dy


@part
def _carried(footing: Any, vibration: Any, static: Any, dt: float, i: int) -> tuple[float, float]:
    """Return the displacement of an anchor in dt, m; on a turning belt by Cayley's rotation, which keeps its radius.

    On a vibrating belt it is that of the mean velocity in dt.
    """
    ux, uy = footing.ux[i], footing.uy[i]
    if vibration is not None:
        h = footing.carrier[i]
        ux += vibration.ahead[h] * vibration.swing_x[h]
        uy += vibration.ahead[h] * vibration.swing_y[h]
    if footing.turn is None:
        return dt * ux, dt * uy
    turn = footing.turn[i] + _turn_ahead(vibration, footing, i)
    half = 0.5 * dt * turn
    vx, vy = ux - turn * static.y[i], uy + turn * static.x[i]
    scale = dt / (1.0 + half * half)
    return scale * (vx - half * vy), scale * (vy + half * vx)


@part
def _turn_ahead(vibration: Any, footing: Any, i: int) -> float:
    """Return the mean angular velocity of a vibrating belt in the coming step, minus its present one, rad/s."""
    if vibration is None:
        return 0.0
    h = footing.carrier[i]
    return vibration.ahead[h] * vibration.swing_turn[h]


@part
def anchor_energy(bottles: Bottles, static: Any, energy: F8, account: int) -> None:
    """Add the energy of the springs under the bottles (J) to an account of `energy`."""
    if static is None:
        return
    for i in range(bottles.x.size):
        if static.belt[i] >= 0:
            entry = uint64(static.belt[i]) * uint64(static.types) + uint64(bottles.type[i])
            ex, ey = bottles.x[i] - static.x[i], bottles.y[i] - static.y[i]
            energy[account] += 0.5 * static.stiffness[entry] * (ex * ex + ey * ey)

"""Friction between a bottle's base and the belt or floor under it: N = m g, at the axis (paper eqs. 7, 15)."""

import math
from typing import Any

from .arrays import Bottles, Load
from .belts import carrier
from .compile import kernel
from .friction import regularisation


@kernel
def surface_velocity(h: int, x: float, y: float, surface: Any, turn: Any) -> tuple[float, float]:
    """Velocity of surface h at a point, m/s: uniform on a straight belt, Omega x (r - C) on a curved one."""
    ux, uy = surface.ux[h], surface.uy[h]
    if turn is not None:
        ux -= turn[h] * (y - surface.cy[h])
        uy += turn[h] * (x - surface.cx[h])
    return ux, uy


@kernel
def add_base_friction(slip_limit: float, bottles: Bottles, load: Load, belts: Any, surface: Any) -> None:
    """Add the friction of belts and floor to `load`; note in `surface.carrier` what each bottle stands on."""
    if surface is None:
        return
    floor = surface.ux.size - 1
    for i in range(bottles.x.size):
        h = carrier(i, belts, floor, bottles.x[i], bottles.y[i])
        surface.carrier[i] = h
        ux, uy = surface_velocity(h, bottles.x[i], bottles.y[i], surface, surface.turn)
        vx = bottles.vx[i] - ux
        vy = bottles.vy[i] - uy
        pull = surface.friction[h, bottles.type[i]] * bottles.weight[i]
        pull *= regularisation(math.sqrt(vx * vx + vy * vy), slip_limit)
        load.fx[i] -= pull * vx
        load.fy[i] -= pull * vy


@kernel
def note_carriers(bottles: Bottles, belts: Any, surface: Any) -> None:
    """Note in `surface.carrier` what each bottle stands on now."""
    if surface is None:
        return
    floor = surface.ux.size - 1
    for i in range(bottles.x.size):
        surface.carrier[i] = carrier(i, belts, floor, bottles.x[i], bottles.y[i])

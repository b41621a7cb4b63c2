# SPDX-License-Identifier: Apache-2.0
"""Velocity field of the belt under each bottle, stored by bottle until it may have left the belt.

At a rebuild each bottle's belt is either certain, wherever it moves within the skin, or tested at every force
evaluation. Force evaluations visit only the bottles to be tested.
"""

from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.support import Footing, Surface
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.support.belts import carrier
from conveyor_sim.engine.threads.workers import units


@part
def stand_on(footing: Footing, surface: Surface, bottles: Bottles, ring: Any, i: int, h: int, alone: bool) -> None:
    """Put bottle i on belt (or floor) h. alone: no other belt is under its ring."""
    footing.carrier[i] = h
    footing.ux[i] = surface.ux[h]
    footing.uy[i] = surface.uy[h]
    _turn_with(footing.turn, surface.turn, i, h)
    footing.friction_limit[i] = surface.friction[h, bottles.type[i]] * bottles.weight[i]
    if ring is not None:
        if not alone and ring.radius[i] > 0.0:
            footing.friction_limit[i] = 0.0


@part
def _turn_with(footing_turn: Any, surface_turn: Any, i: int, h: int) -> None:
    if surface_turn is not None:
        footing_turn[i] = surface_turn[h]


@kernel
def refresh_footing(bottles: Bottles, belts: Any, surface: Any, footing: Any, ring: Any) -> None:
    """Put every bottle on its belt, after commands, supply and rebuilds."""
    if surface is None:
        return
    floor = surface.ux.size - 1
    for i in range(bottles.x.size):
        h = carrier(i, belts, floor, bottles.x[i], bottles.y[i])
        stand_on(footing, surface, bottles, ring, i, h, _certain(belts, i))


@part
def _certain(belts: Any, i: int) -> bool:
    if belts is None:
        return True
    return belts.certain[i] >= 0


@part
def check_footing(bottles: Bottles, belts: Any, surface: Any, footing: Any, ring: Any, first: int, end: int) -> None:
    """Update the belt of those bottles, first to end, that may have moved to another belt."""
    if belts is None:
        return
    floor = surface.ux.size - 1
    begin, stop = units(first, end)
    for entry in range(belts.uncertain.first[begin], belts.uncertain.first[stop]):
        i = belts.uncertain.bottle[entry]
        h = carrier(i, belts, floor, bottles.x[i], bottles.y[i])
        if h != footing.carrier[i]:
            stand_on(footing, surface, bottles, ring, i, h, False)


@kernel
def find_carriers(bottles: Bottles, belts: Any, surface: Surface, carriers: Any, carried: Any) -> None:
    """Write the surface (belt or plate) under each bottle's axis, and the number of bottles on each, (surfaces,).

    `carriers` holds one surface index per slot; -1 for the floor and free slots. The state does not change.
    """
    floor = surface.ux.size - 1
    for h in range(floor):
        carried[h] = 0
    for i in range(bottles.x.size):
        carriers[i] = -1
        if bottles.id[i] >= 0:
            h = carrier(i, belts, floor, bottles.x[i], bottles.y[i])
            if h < floor:
                carriers[i] = h
                carried[h] += 1

# SPDX-License-Identifier: Apache-2.0
"""Rebuild of all neighbour lists together, which is due once a bottle has moved by its way, or half of the skin.

The time of a rebuild depends on the state alone, not on the division of a run into calls.
"""

from typing import Any

from numba import uint64

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import Neighbourhood
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.engine.compiler.compile import copy, kernel, part
from conveyor_sim.engine.contact.slots import fill_slots
from conveyor_sim.engine.impulses.carry import order_pairs
from conveyor_sim.engine.lists.near import list_near_arcs, list_near_bodies, list_near_segments, list_railed
from conveyor_sim.engine.lists.neighbours import list_pairs
from conveyor_sim.engine.lists.static_grid import find_homes
from conveyor_sim.engine.lists.ways import plan_ways
from conveyor_sim.engine.rails.poses import place_bodies
from conveyor_sim.engine.support.belts import list_belts
from conveyor_sim.engine.support.footing import refresh_footing


@kernel
def rebuild(world: World) -> tuple[int, int, int, int, int, int]:
    """Rebuild all lists; return the numbers of entries that pairs, slots, segments, arcs, belts and bodies need.

    Coefficients by pair are not filled, so that this is compiled once for all laws: `fill_laws` must follow. If a list
    needs more than its capacity, the lists are incomplete and `neighbourhood.stale` is set: enlarge them and call
    again.
    """
    bottles, hood = world.bottles, world.neighbourhood
    skin, ways = world.settings.skin, hood.ways
    plan_ways(bottles, ways)
    find_homes(bottles, world.grid, hood.home)
    pairs = list_pairs(bottles, hood, world.pairs, world.settings.cell, skin)
    more = fill_slots(world.pairs, world.slots)
    segments = list_near_segments(bottles, world.grid, hood.home, world.segments, world.near_segments, ways, 0.5 * skin)
    arcs = list_near_arcs(bottles, world.grid, hood.home, world.arcs, world.near_arcs, ways, 0.5 * skin)
    bodies = list_near_bodies(bottles, world.grid, hood.home, world.moving, world.near_bodies, ways, 0.5 * skin)
    list_railed(bottles, world.near_segments, world.near_arcs, world.near_bodies, world.railed)
    floor = _floor(world.surface)
    belts = list_belts(bottles, world.grid, hood.home, world.belts, world.ring, floor, ways, 0.5 * skin)
    copy(bottles.x, hood.x)
    copy(bottles.y, hood.y)
    fits = _fits_pairs(pairs, world.pairs) and _fits_slots(more, world.slots) and _fits_belts(belts, world.belts)
    fits = fits and _fits_near(segments, world.near_segments) and _fits_near(arcs, world.near_arcs)
    fits = fits and _fits_near(bodies, world.near_bodies)
    hood.stale[0] = 0 if fits else 1
    if fits:
        refresh_footing(bottles, world.belts, world.surface, world.footing, world.ring)
        order_pairs(bottles, world.pairs, world.impulses)
    _place(world.moving)
    return pairs, more, segments, arcs, belts, bodies


@part
def _place(moving: Any) -> None:
    """Place the bodies that have become near to a bottle."""
    if moving is not None:
        place_bodies(moving, True)


@part
def _floor(surface: Any) -> int:
    if surface is None:
        return 0
    return surface.ux.size - 1


@part
def _fits_pairs(needed: int, pairs: Any) -> bool:
    if pairs is None:
        return True
    return needed <= pairs.i.size


@part
def _fits_slots(needed: int, slots: Any) -> bool:
    if slots is None:
        return True
    return needed <= slots.more_entry.size


@part
def _fits_near(needed: int, near: Any) -> bool:
    if near is None:
        return True
    return needed <= near.piece.size


@part
def _fits_belts(needed: int, belts: Any) -> bool:
    if belts is None:
        return True
    return needed <= belts.candidate.size


@part
def moved_too_far(bottles: Bottles, hood: Neighbourhood, skin: float, first: int, end: int) -> bool:
    """Return True if a bottle of first to end has moved by more than half the skin since the last rebuild."""
    limit = 0.25 * skin * skin
    far = 0
    for i in range(uint64(first), uint64(end)):
        dx = bottles.x[i] - hood.x[i]
        dy = bottles.y[i] - hood.y[i]
        far |= dx * dx + dy * dy > limit
    return far != 0

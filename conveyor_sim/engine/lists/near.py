# SPDX-License-Identifier: Apache-2.0
"""Rail pieces and bodies near each bottle, within its radius and its way until the next rebuild.

Tangential springs at rails are stored by piece: a bottle that passes a joint from one piece of a surface to the next
starts a new spring there.
"""

import math
from typing import Any

from conveyor_sim.engine.arrays.bodies import Bottles
from conveyor_sim.engine.arrays.lists import BottleList, Near
from conveyor_sim.engine.arrays.types import I4
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.impulses.carry import restore_near, store_near
from conveyor_sim.engine.lists.ways import margin_of
from conveyor_sim.engine.rails.poses import list_near_axes
from conveyor_sim.engine.threads.workers import UNIT


@part
def list_near_segments(
    bottles: Bottles, grid: Any, homes: I4, segments: Any, near: Any, ways: Any, margin: float
) -> int:
    """List the straight rail pieces within the radius and the way of each bottle; return the number of entries needed.

    margin: way, in m, where `ways` is None.
    """
    if segments is None:
        return 0
    _copy_springs(near, near.springs)
    store_near(near, near.impulse)
    count = 0
    for i in range(bottles.x.size):
        near.start[i] = min(count, near.piece.size)
        home = homes[i]
        if home < 0:
            continue
        reach = bottles.radius[i] + margin_of(ways, i, margin)
        for entry in range(grid.segment_start[home], grid.segment_start[home + 1]):
            g = grid.segment[entry]
            dx = bottles.x[i] - segments.x[g]
            dy = bottles.y[i] - segments.y[g]
            along = dx * segments.tx[g] + dy * segments.ty[g]
            along = min(max(along, 0.0), segments.length[g])
            dx -= along * segments.tx[g]
            dy -= along * segments.ty[g]
            if dx * dx + dy * dy <= reach * reach:
                if count < near.piece.size:
                    near.piece[count] = g
                count += 1
    near.start[bottles.x.size] = min(count, near.piece.size)
    if count <= near.piece.size:
        _restore_springs(near, near.springs)
        restore_near(near, near.impulse)
    return count


@part
def list_near_arcs(bottles: Bottles, grid: Any, homes: I4, arcs: Any, near: Any, ways: Any, margin: float) -> int:
    """List the arcs within the radius and the way of each bottle, as `list_near_segments`."""
    if arcs is None:
        return 0
    _copy_springs(near, near.springs)
    store_near(near, near.impulse)
    count = 0
    for i in range(bottles.x.size):
        near.start[i] = min(count, near.piece.size)
        home = homes[i]
        if home < 0:
            continue
        reach = bottles.radius[i] + margin_of(ways, i, margin)
        for entry in range(grid.arc_start[home], grid.arc_start[home + 1]):
            k = grid.arc[entry]
            dx = bottles.x[i] - arcs.x[k]
            dy = bottles.y[i] - arcs.y[k]
            # The full circle replaces the arc here, so there are never too few candidates.
            if abs(math.sqrt(dx * dx + dy * dy) - arcs.radius[k]) <= reach:
                if count < near.piece.size:
                    near.piece[count] = k
                count += 1
    near.start[bottles.x.size] = min(count, near.piece.size)
    if count <= near.piece.size:
        _restore_springs(near, near.springs)
        restore_near(near, near.impulse)
    return count


@part
def list_near_bodies(bottles: Bottles, grid: Any, homes: I4, moving: Any, near: Any, ways: Any, margin: float) -> int:
    """List the bodies whose sweep is within the radius and the way of each bottle, and the axes of these bodies.

    Return the number of entries needed. near: None if bottles pass through bodies; no body is near a bottle then.
    """
    if moving is None:
        return 0
    for b in range(moving.is_near.size):
        moving.is_near[b] = 0
    count = _list_bodies(bottles, grid, homes, moving, near, ways, margin)
    list_near_axes(moving)
    return count


@part
def _list_bodies(bottles: Bottles, grid: Any, homes: I4, moving: Any, near: Any, ways: Any, margin: float) -> int:
    if near is None:
        return 0
    count = 0
    for i in range(bottles.x.size):
        near.start[i] = min(count, near.piece.size)
        home = homes[i]
        if home < 0:
            continue
        reach = bottles.radius[i] + margin_of(ways, i, margin)
        for entry in range(grid.body_start[home], grid.body_start[home + 1]):
            b = grid.body[entry]
            inside_x = moving.sweep[b, 0] - reach <= bottles.x[i] <= moving.sweep[b, 2] + reach
            if inside_x and moving.sweep[b, 1] - reach <= bottles.y[i] <= moving.sweep[b, 3] + reach:
                moving.is_near[b] = 1
                if count < near.piece.size:
                    near.piece[count] = b
                count += 1
    near.start[bottles.x.size] = min(count, near.piece.size)
    return count


@part
def list_railed(bottles: Bottles, near_segments: Any, near_arcs: Any, near_bodies: Any, railed: Any) -> None:
    """List the bottles with any rail or body near, by unit."""
    if railed is None:
        return
    count = 0
    for i in range(bottles.x.size):
        if i % UNIT == 0:
            railed.first[i // UNIT] = count
        if _has_near(near_segments, i) or _has_near(near_arcs, i) or _has_near(near_bodies, i):
            railed.bottle[count] = i
            count += 1
    end_list(railed, bottles.x.size, count)


@part
def end_list(listed: BottleList, bottles: int, count: int) -> None:
    """End a list by unit that holds `count` of all bottles."""
    for unit in range((bottles + UNIT - 1) // UNIT, listed.first.size):
        listed.first[unit] = count


@part
def _has_near(near: Any, i: int) -> bool:
    if near is None:
        return False
    return near.start[i] < near.start[i + 1]


@part
def _copy_springs(near: Near, springs: Any) -> None:
    """Copy the springs by bottle and piece, unless a previous attempt with a shorter list has done so."""
    if springs is None:
        return
    if springs.kept_count[0] >= 0:
        return
    kept = 0
    for i in range(near.start.size - 1):
        for entry in range(near.start[i], near.start[i + 1]):
            if springs.elongation[entry] != 0.0:
                springs.kept_bottle[kept] = i
                springs.kept_piece[kept] = near.piece[entry]
                springs.kept[kept] = springs.elongation[entry]
                kept += 1
    springs.kept_count[0] = kept


@part
def _restore_springs(near: Near, springs: Any) -> None:
    """Restore the springs of entries that are still listed; both lists are sorted by bottle."""
    if springs is None:
        return
    k, kept = 0, springs.kept_count[0]
    for i in range(near.start.size - 1):
        while k < kept and springs.kept_bottle[k] < i:
            k += 1
        for entry in range(near.start[i], near.start[i + 1]):
            springs.elongation[entry] = 0.0
            same = k
            while same < kept and springs.kept_bottle[same] == i:
                if springs.kept_piece[same] == near.piece[entry]:
                    springs.elongation[entry] = springs.kept[same]
                same += 1
    springs.kept_count[0] = -1


@kernel
def drop_near_springs(near: Any, springs: Any, slot: int) -> None:
    """Reset the springs of a bottle that is removed."""
    if springs is None:
        return
    for entry in range(near.start[slot], near.start[slot + 1]):
        springs.elongation[entry] = 0.0

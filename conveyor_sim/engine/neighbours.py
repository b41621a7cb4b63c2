"""Verlet lists with a skin: who may touch whom, valid until a bottle has moved by half the skin.

Candidates come from a hashed cell grid (bottles) and from a static grid over the plant (rails and belts). Lists are
sorted by slot, so that sums over them, and hence the bits of a run, do not depend on when a rebuild happened.
"""

import math
from typing import Any

from .arrays import Bottles, Neighbourhood, World
from .belts import belt_distance
from .compile import copy, kernel


@kernel
def bucket_of(cx: int, cy: int, buckets: int) -> int:
    """Bucket of a cell; different cells may share one, so a member's own cell must still be compared."""
    return (cx * 73856093 ^ cy * 19349663) & (buckets - 1)


@kernel
def sort_into_cells(bottles: Bottles, hood: Neighbourhood, cell: float) -> None:
    """Counting sort of the occupied slots by hashed cell."""
    buckets = hood.bucket.size - 1
    hood.bucket[:] = 0
    for i in range(bottles.x.size):
        if bottles.id[i] >= 0:
            hood.cell[i, 0] = math.floor(bottles.x[i] / cell)
            hood.cell[i, 1] = math.floor(bottles.y[i] / cell)
            hood.bucket[bucket_of(hood.cell[i, 0], hood.cell[i, 1], buckets)] += 1
    total = 0
    for b in range(buckets + 1):
        total += hood.bucket[b]
        hood.bucket[b] = total
    # Backwards, so that each bucket ends up at its start and in the order of slots.
    for i in range(bottles.x.size - 1, -1, -1):
        if bottles.id[i] >= 0:
            b = bucket_of(hood.cell[i, 0], hood.cell[i, 1], buckets)
            hood.bucket[b] -= 1
            hood.order[hood.bucket[b]] = i


@kernel
def list_pairs(bottles: Bottles, hood: Neighbourhood, pairs: Any, law: Any, cell: float, skin: float) -> int:
    """Fill the pair list, sorted by (i, j), i < j; return the number of pairs, which may exceed its capacity."""
    if pairs is None:
        return 0
    sort_into_cells(bottles, hood, cell)
    buckets = hood.bucket.size - 1
    capacity = pairs.i.size
    count = 0
    for i in range(bottles.x.size):
        if bottles.id[i] < 0:
            continue
        first = count
        for cx in range(hood.cell[i, 0] - 1, hood.cell[i, 0] + 2):
            for cy in range(hood.cell[i, 1] - 1, hood.cell[i, 1] + 2):
                b = bucket_of(cx, cy, buckets)
                for entry in range(hood.bucket[b], hood.bucket[b + 1]):
                    j = hood.order[entry]
                    if j <= i or hood.cell[j, 0] != cx or hood.cell[j, 1] != cy:
                        continue
                    dx = bottles.x[j] - bottles.x[i]
                    dy = bottles.y[j] - bottles.y[i]
                    reach = bottles.radius[i] + bottles.radius[j] + skin
                    if dx * dx + dy * dy < reach * reach:
                        if count < capacity:
                            k = count
                            while k > first and pairs.j[k - 1] > j:
                                pairs.j[k] = pairs.j[k - 1]
                                k -= 1
                            pairs.j[k] = j
                            pairs.i[count] = i
                        count += 1
    pairs.used[0] = min(count, capacity)
    _fill(pairs.stiffness, law.stiffness, bottles, pairs)
    _fill(pairs.friction, law.friction, bottles, pairs)
    _fill(pairs.damping_paper, law.damping_paper, bottles, pairs)
    _fill(pairs.damping_normal, law.damping_normal, bottles, pairs)
    return count


@kernel
def _fill(column: Any, table: Any, bottles: Bottles, pairs: Any) -> None:
    if column is None:
        return
    for p in range(pairs.used[0]):
        column[p] = table[bottles.type[pairs.i[p]], bottles.type[pairs.j[p]]]


@kernel
def static_cell(grid: Any, x: float, y: float) -> int:
    """Cell of the static grid under a point, -1 outside: nothing of the plant is near there."""
    if not (x >= grid.x and y >= grid.y):
        return -1
    column = (x - grid.x) / grid.size
    row = (y - grid.y) / grid.size
    if not (column < grid.columns and row < grid.rows):
        return -1
    return int(row) * grid.columns + int(column)


@kernel
def list_near_segments(bottles: Bottles, grid: Any, segments: Any, near: Any, margin: float) -> int:
    """List the straight rail pieces within radius + margin of each bottle; return how many entries that takes."""
    if segments is None:
        return 0
    count = 0
    for i in range(bottles.x.size):
        near.start[i] = min(count, near.piece.size)
        home = static_cell(grid, bottles.x[i], bottles.y[i]) if bottles.id[i] >= 0 else -1
        if home < 0:
            continue
        reach = bottles.radius[i] + margin
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
    return count


@kernel
def list_near_arcs(bottles: Bottles, grid: Any, arcs: Any, near: Any, margin: float) -> int:
    """List the arcs within radius + margin of each bottle; return how many entries that takes."""
    if arcs is None:
        return 0
    count = 0
    for i in range(bottles.x.size):
        near.start[i] = min(count, near.piece.size)
        home = static_cell(grid, bottles.x[i], bottles.y[i]) if bottles.id[i] >= 0 else -1
        if home < 0:
            continue
        reach = bottles.radius[i] + margin
        for entry in range(grid.arc_start[home], grid.arc_start[home + 1]):
            k = grid.arc[entry]
            dx = bottles.x[i] - arcs.x[k]
            dy = bottles.y[i] - arcs.y[k]
            # The whole circle stands for the arc here: never too few candidates.
            if abs(math.sqrt(dx * dx + dy * dy) - arcs.radius[k]) <= reach:
                if count < near.piece.size:
                    near.piece[count] = k
                count += 1
    near.start[bottles.x.size] = min(count, near.piece.size)
    return count


@kernel
def list_belts(bottles: Bottles, grid: Any, belts: Any, floor: int, margin: float) -> int:
    """Find for each bottle the belt that is certain within `margin`, else list candidates; return their number."""
    if belts is None:
        return 0
    count = 0
    for i in range(bottles.x.size):
        belts.start[i] = min(count, belts.candidate.size)
        belts.certain[i] = floor
        home = static_cell(grid, bottles.x[i], bottles.y[i]) if bottles.id[i] >= 0 else -1
        if home < 0:
            continue
        first = count
        # The last listed belt carries: the grid lists them in that order.
        for entry in range(grid.belt_start[home], grid.belt_start[home + 1]):
            h = grid.belt[entry]
            distance = belt_distance(belts, belts.sectors, h, bottles.x[i], bottles.y[i])
            if distance <= -margin:
                continue
            if distance >= margin and count == first:
                belts.certain[i] = h
                break
            belts.certain[i] = -1
            if count < belts.candidate.size:
                belts.candidate[count] = h
            count += 1
            if distance >= margin:
                break
    belts.start[bottles.x.size] = min(count, belts.candidate.size)
    return count


@kernel
def rebuild(world: World) -> tuple[int, int, int, int]:
    """Make all lists anew; return the entries that pairs, segments, arcs and belts need.

    Where that is more than a list holds, the lists are incomplete and `neighbourhood.stale` is set: grow, call again.
    """
    bottles, hood = world.bottles, world.neighbourhood
    skin = world.settings.skin
    pairs = list_pairs(bottles, hood, world.pairs, world.pair_law, world.settings.cell, skin)
    segments = list_near_segments(bottles, world.grid, world.segments, world.near_segments, 0.5 * skin)
    arcs = list_near_arcs(bottles, world.grid, world.arcs, world.near_arcs, 0.5 * skin)
    belts = list_belts(bottles, world.grid, world.belts, _floor(world.surface), 0.5 * skin)
    copy(bottles.x, hood.x)
    copy(bottles.y, hood.y)
    fits = _fits_pairs(pairs, world.pairs) and _fits_near(segments, world.near_segments)
    fits = fits and _fits_near(arcs, world.near_arcs) and _fits_belts(belts, world.belts)
    hood.stale[0] = 0 if fits else 1
    return pairs, segments, arcs, belts


@kernel
def _floor(surface: Any) -> int:
    if surface is None:
        return 0
    return surface.ux.size - 1


@kernel
def _fits_pairs(needed: int, pairs: Any) -> bool:
    if pairs is None:
        return True
    return needed <= pairs.i.size


@kernel
def _fits_near(needed: int, near: Any) -> bool:
    if near is None:
        return True
    return needed <= near.piece.size


@kernel
def _fits_belts(needed: int, belts: Any) -> bool:
    if belts is None:
        return True
    return needed <= belts.candidate.size


@kernel
def moved_too_far(bottles: Bottles, hood: Neighbourhood, skin: float) -> bool:
    """Whether some bottle has moved by more than half the skin since the last rebuild."""
    limit = 0.25 * skin * skin
    furthest = 0.0
    for i in range(bottles.x.size):
        dx = bottles.x[i] - hood.x[i]
        dy = bottles.y[i] - hood.y[i]
        squared = dx * dx + dy * dy
        furthest = squared if squared > furthest else furthest
    return furthest > limit

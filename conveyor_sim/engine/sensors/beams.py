# SPDX-License-Identifier: Apache-2.0
"""Times in a tick at which the circles of bottles block light beams.

A bottle's path through a tick is the cubic through its positions and velocities at both ends (Hermite), divided into
chords of equal duration. Bottles come and go between ticks only, so each slot has the same bottle throughout.
"""

import math
from collections.abc import Sequence

import numpy as np

from conveyor_sim.engine.arrays.beams import BottleMotion, LightBeams
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.compiler.compile import kernel, part
from conveyor_sim.engine.lists.static_grid import build_static_grid, cell_at

CHORDS = 8
"""Chords per path. At 1 g in a tick of 10 ms they deviate from it by 2 micrometres."""

STILL = 1e-13
"""A bottle that moves by less than this distance in a chord rests, m."""

ROUNDING = 1e-9
"""Shorter intervals are ignored, s."""

REACH, CELL = 0.25, 0.5
"""Distance from its axis at which a bottle finds a beam in the grid, and edge of the cells, m. Faster bottles, whose
paths reach farther, are compared with all beams."""

FREE, BLOCKED, CHANGES = 0, 1, 2
"""State of a beam in a tick: free throughout, blocked throughout, or neither."""


Ends = tuple[tuple[float, float], tuple[float, float]]
"""Both ends of a beam, m."""


def light_beams(ends: Sequence[Ends]) -> LightBeams:
    """Return beams between these ends."""
    start, end = np.array(ends, dtype=np.float64).swapaxes(0, 1)
    length = np.hypot(*(end - start).T)[:, None]
    boxes, none = np.hstack((np.minimum(start, end), np.maximum(start, end))), np.empty((0, 4))
    return LightBeams(
        line=np.hstack((start, boxes, (end - start) / length, length)),
        grid=build_static_grid(none, none, none, boxes, REACH + STILL, 0.0, CELL),
        near=np.empty((2, 16), dtype=np.int64),
        spans=np.empty((len(ends), 16, 2)),
        used=np.zeros(len(ends), dtype=np.int64),
        state=np.zeros(len(ends), dtype=np.int64),
    )


@kernel
def block_beams(motion: BottleMotion, length: float, beams: LightBeams) -> int:
    """Compute when in a tick of `length` s bottles block each beam: write its spans, their number and its state.

    Return which array is too small: 0 none, 1 near, 2 spans.
    """
    count, state, spans, near = beams.used, beams.state, beams.spans, beams.near
    pairs = _near(motion, length / 3.0, beams)
    if pairs < 0:
        return 1
    for beam in range(count.size):
        count[beam] = 0
        state[beam] = FREE
    for pair in range(pairs):
        beam, i = near[0, pair], near[1, pair]
        # Points within reach of a segment form a convex set: a path whose hull is inside stays inside.
        if state[beam] != BLOCKED and _throughout(motion, length / 3.0, beams.line, beam, i):
            state[beam] = BLOCKED
            count[beam] = 1
            spans[beam, 0, 0], spans[beam, 0, 1] = 0.0, length
    for pair in range(pairs):
        beam, i = near[0, pair], near[1, pair]
        if state[beam] != BLOCKED:
            if not _follow(motion, length, beams, beam, i):
                return 2
    for beam in range(count.size):
        if state[beam] != BLOCKED and count[beam] > 0:
            count[beam] = _join(spans[beam], count[beam])
            first, last = spans[beam, 0, 0], spans[beam, count[beam] - 1, 1]
            throughout = count[beam] == 1 and first <= ROUNDING and last >= length - ROUNDING
            state[beam] = BLOCKED if throughout else CHANGES
    return 0


@part
def _near(motion: BottleMotion, third: float, beams: LightBeams) -> int:
    """Write pairs of a beam and a slot whose path may come within reach. Return their number, -1 if they don't fit."""
    start, x, y, radius = motion.start, motion.x, motion.y, motion.radius
    line, grid, near = beams.line, beams.grid, beams.near
    pairs = 0
    for i in range(x.size):
        if motion.id[i] < 0:
            continue
        # A cubic lies within the hull of its four control points (Bézier).
        ahead, behind = start[0, i] + third * start[2, i], x[i] - third * motion.vx[i]
        low_x = min(min(start[0, i], ahead), min(behind, x[i])) - radius[i]
        high_x = max(max(start[0, i], ahead), max(behind, x[i])) + radius[i]
        ahead, behind = start[1, i] + third * start[3, i], y[i] - third * motion.vy[i]
        low_y = min(min(start[1, i], ahead), min(behind, y[i])) - radius[i]
        high_y = max(max(start[1, i], ahead), max(behind, y[i])) + radius[i]
        listed = max(max(high_x - x[i], x[i] - low_x), max(high_y - y[i], y[i] - low_y)) <= REACH
        first, end = 0, line.shape[0]
        if listed:
            home = cell_at(grid, x[i], y[i])
            if home < 0:
                continue
            first, end = grid.body_start[home], grid.body_start[home + 1]
        for entry in range(first, end):
            beam = grid.body[entry] if listed else entry
            if high_x >= line[beam, 2] and low_x <= line[beam, 4] and high_y >= line[beam, 3]:
                if low_y <= line[beam, 5]:
                    if pairs == near.shape[1]:
                        return -1
                    near[0, pairs], near[1, pairs] = beam, i
                    pairs += 1
    return pairs


@part
def _throughout(motion: BottleMotion, third: float, line: F8, beam: int, i: int) -> bool:
    """Return True if the complete path of slot i is within reach of a beam."""
    start, x, y, radius = motion.start, motion.x[i], motion.y[i], motion.radius[i]
    return (
        _beside(line, beam, start[0, i], start[1, i]) <= radius
        and _beside(line, beam, start[0, i] + third * start[2, i], start[1, i] + third * start[3, i]) <= radius
        and _beside(line, beam, x - third * motion.vx[i], y - third * motion.vy[i]) <= radius
        and _beside(line, beam, x, y) <= radius
    )


@part
def _beside(line: F8, beam: int, x: float, y: float) -> float:
    """Return the distance of a point from a beam, m."""
    along, aside = _seen_from(line, beam, x, y)
    return math.hypot(along - min(max(along, 0.0), line[beam, 8]), aside)


@part
def _seen_from(line: F8, beam: int, x: float, y: float) -> tuple[float, float]:
    """Return a point relative to the start of a beam: along it, and to its left, m."""
    x, y = x - line[beam, 0], y - line[beam, 1]
    ahead, across = line[beam, 6], line[beam, 7]
    return x * ahead + y * across, y * ahead - x * across


@part
def _follow(motion: BottleMotion, length: float, beams: LightBeams, beam: int, i: int) -> bool:
    """Add the blocked intervals of one path to the spans of a beam, by start; return False if there is no room."""
    third, share = length / 3.0, length / CHORDS
    start, x, y, line, spans, count = motion.start, motion.x[i], motion.y[i], beams.line, beams.spans, beams.used
    x1, x2 = start[0, i] + third * start[2, i], x - third * motion.vx[i]
    y1, y2 = start[1, i] + third * start[3, i], y - third * motion.vy[i]
    a, b = _seen_from(line, beam, start[0, i], start[1, i])
    for chord in range(CHORDS):
        # Ends are exact, so that ticks join without a gap.
        last = chord == CHORDS - 1
        end_x = x if last else cubic(start[0, i], x1, x2, x, (chord + 1) / CHORDS)
        end_y = y if last else cubic(start[1, i], y1, y2, y, (chord + 1) / CHORDS)
        next_a, next_b = _seen_from(line, beam, end_x, end_y)
        enter, leave = within_reach(a, b, next_a, next_b, line[beam, 8], motion.radius[i])
        if enter <= leave:
            if count[beam] == spans.shape[1]:
                return False
            _insert(spans[beam], count[beam], (chord + enter) * share, (chord + leave) * share)
            count[beam] += 1
        a, b = next_a, next_b
    return True


@part
def cubic(c0: float, c1: float, c2: float, c3: float, s: float) -> float:
    """Return the point of a cubic with these control points at a parameter."""
    r = 1.0 - s
    # Differences from the start, so that a point at rest stays constant to the last bit.
    return c0 + (3.0 * (r * r) * s * (c1 - c0) + 3.0 * r * (s * s) * (c2 - c0) + s * s * s * (c3 - c0))


@part
def _insert(spans: F8, count: int, begin: float, end: float) -> None:
    place = count
    while place > 0 and spans[place - 1, 0] > begin:
        spans[place, 0], spans[place, 1] = spans[place - 1, 0], spans[place - 1, 1]
        place -= 1
    spans[place, 0], spans[place, 1] = begin, end


@part
def _join(spans: F8, count: int) -> int:
    """Merge spans that touch; return their new number."""
    kept = 1
    for n in range(1, count):
        if spans[n, 0] <= spans[kept - 1, 1] + ROUNDING:
            spans[kept - 1, 1] = max(spans[n, 1], spans[kept - 1, 1])
        else:
            spans[kept, 0], spans[kept, 1] = spans[n, 0], spans[n, 1]
            kept += 1
    return kept


@part
def within_reach(a: float, b: float, next_a: float, next_b: float, length: float, radius: float) -> tuple[float, float]:
    """Return the shares of a chord at which a point comes within a radius of a segment and leaves; or enter > leave.

    (a, b) to (next_a, next_b): the chord's ends along the segment and to its left, m, from its start. The points within
    a radius of a segment form a convex set (two discs and a rectangle), so a chord has at most one such interval.
    """
    u, v = next_a - a, next_b - b
    if math.hypot(u, v) <= STILL:
        u, v = 0.0, 0.0
    enter, leave = np.inf, -np.inf
    first, last = _slab(a, u, 0.0, length)
    begin, end = _slab(b, v, -radius, radius)
    enter, leave = _widen(enter, leave, max(first, begin), min(last, end))
    for at in (0.0, length):
        first, last = _disc(a - at, b, u, v, radius)
        enter, leave = _widen(enter, leave, first, last)
    return enter, leave


@part
def _widen(enter: float, leave: float, first: float, last: float) -> tuple[float, float]:
    first, last = max(first, 0.0), min(last, 1.0)
    if first <= last:
        return min(enter, first), max(leave, last)
    return enter, leave


@part
def _slab(place: float, step: float, low: float, high: float) -> tuple[float, float]:
    """Return the shares of a motion between which a coordinate is in [low, high]."""
    if step == 0.0:
        return (-np.inf, np.inf) if low <= place <= high else (np.inf, -np.inf)
    one, other = (low - place) / step, (high - place) / step
    return min(one, other), max(one, other)


@part
def _disc(a: float, b: float, u: float, v: float, radius: float) -> tuple[float, float]:
    """Return the shares of a motion between which a point is within a radius of the origin."""
    square, half, out = u * u + v * v, a * u + b * v, a * a + b * b - radius * radius
    if square == 0.0:
        return (-np.inf, np.inf) if out <= 0.0 else (np.inf, -np.inf)
    inside = half * half - square * out
    if inside < 0.0:
        return np.inf, -np.inf
    root = math.sqrt(inside)
    return (-half - root) / square, (-half + root) / square

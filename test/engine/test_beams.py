# SPDX-License-Identifier: Apache-2.0
"""Paths through a tick, and when a circle on one of them crosses a segment: against samples and closed forms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from worlds import callable_part

from conveyor_sim.engine.arrays.beams import BottleMotion
from conveyor_sim.engine.sensors.beams import BLOCKED, CHANGES, CHORDS, FREE, block_beams, light_beams
from conveyor_sim.engine.sensors.beams import cubic as cubic_part
from conveyor_sim.engine.sensors.beams import within_reach as within_reach_part

cubic = callable_part(cubic_part)
within_reach = callable_part(within_reach_part)

F8 = NDArray[np.float64]


def distance(along: F8, aside: F8, length: F8 | float) -> F8:
    """Return distances of points from a segment."""
    return np.hypot(along - np.clip(along, 0.0, length), aside)


def test_a_chord_is_within_reach_from_where_to_where() -> None:
    """Random chords and segments, some collinear, some without motion: the bounds, and a sample of points between."""
    rng = np.random.default_rng(5)
    k = 4000
    along, aside = rng.uniform(-1.5, 2.5, (2, k)), rng.uniform(-1.5, 1.5, (2, k))
    aside[1, :400] = aside[0, :400]
    along[1, 400:800] = along[0, 400:800]
    along[1, 800:1000], aside[1, 800:1000] = along[0, 800:1000], aside[0, 800:1000]
    length, radius = rng.uniform(0.0, 1.5, k), rng.uniform(0.05, 0.8, k)
    chords = zip(along[0], aside[0], along[1], aside[1], length, radius, strict=True)
    enter, leave = np.array([within_reach(*chord) for chord in chords]).T
    shares = np.linspace(0.0, 1.0, 201)[:, None]
    inside = distance(*((1.0 - shares) * c[0] + shares * c[1] for c in (along, aside)), length) <= radius
    told = (enter <= shares) & (shares <= leave)
    off = (np.abs(shares - enter) > 1e-9) & (np.abs(shares - leave) > 1e-9)
    np.testing.assert_array_equal(told[off], inside[off])
    assert 1000 < np.count_nonzero(enter <= leave) < 3000
    for share in (enter, leave):
        within = (enter <= leave) & (share > 0.0) & (share < 1.0)
        at = [(1.0 - share[within]) * c[0][within] + share[within] * c[1][within] for c in (along, aside)]
        np.testing.assert_allclose(distance(*at, length[within]), radius[within], atol=1e-9)
        assert within.sum() > 500


def test_a_way_is_the_cubic_through_its_control_points() -> None:
    """The cubic is exact for constant and for linear acceleration; a point at rest stays constant to the last bit."""
    h, shares = 0.01, np.arange(CHORDS + 1) / CHORDS
    for c in ([0.1, 0.5, 3.0, -40.0], [0.3, -0.2, 1.0, 70.0], [0.7, 0.0, 0.0, 0.0]):
        begin, end = c[0], float(np.polyval(c[::-1], h))
        slope = float(np.polyval(np.polyder(c[::-1]), h))
        way = [cubic(begin, begin + h / 3.0 * c[1], end - h / 3.0 * slope, end, float(share)) for share in shares]
        np.testing.assert_allclose(way, np.polyval(c[::-1], h * shares), rtol=0.0, atol=1e-15)
        assert any(c[1:]) or set(way) == {0.7}


LENGTH = 0.01
"""Duration of a tick, s."""
ENDS = np.array([[[-0.1, 0.0], [0.1, 0.02]], [[0.05, -0.1], [0.05, 0.1]], [[0.19, 0.19], [0.2, 0.2]]])
"""Ends of three beams, m."""


def blocked(start: F8, end: F8, radius: F8, ids: NDArray[np.int64], room: int) -> tuple[list[F8], list[int]]:
    """Return spans and state of each beam; start, end: x, y, vx, vy by slot."""
    ends = [((begin[0], begin[1]), (end[0], end[1])) for begin, end in ENDS.tolist()]
    beams = light_beams(ends)._replace(near=np.empty((2, room), np.int64), spans=np.empty((len(ENDS), room, 2)))
    while short := block_beams(BottleMotion(start, *end, radius, ids), LENGTH, beams):
        if short == 1:
            beams = beams._replace(near=np.empty((2, 2 * beams.near.shape[1]), np.int64))
        else:
            beams = beams._replace(spans=np.empty((len(ENDS), 2 * beams.spans.shape[1], 2)))
    return [beams.spans[beam, : beams.used[beam]] for beam in range(len(ENDS))], beams.state.tolist()


def test_a_beam_is_blocked_while_any_way_is_within_reach_of_it() -> None:
    """Random paths, some without motion, some of free slots: spans against samples, state against spans."""
    rng = np.random.default_rng(11)
    slots, seen = 12, [0, 0, 0]
    shares = np.linspace(0.0, 1.0, 401)[:, None]
    for _ in range(150):
        x0, y0 = rng.uniform(-0.2, 0.2, (2, slots))
        vx0, vy0 = rng.uniform(-25.0, 25.0, (2, slots))
        vx0[:4], vy0[:4] = 0.0, 0.0
        vx, vy = vx0 + rng.uniform(-0.1, 0.1, slots) * (vx0 != 0.0), vy0.copy()
        x, y = x0 + 0.5 * LENGTH * (vx0 + vx), y0 + LENGTH * vy0
        radius, ids = rng.uniform(0.01, 0.05, slots), np.where(rng.random(slots) < 0.5, np.arange(slots), -1)
        spans, state = blocked(np.stack((x0, y0, vx0, vy0)), np.stack((x, y, vx, vy)), radius, ids, room=1)
        # With constant acceleration the cubic is a parabola.
        time = shares * LENGTH
        way_x, way_y = x0 + time * (vx0 + 0.5 * time * (vx - vx0) / LENGTH), y0 + time * vy0
        for beam, (begin, end) in enumerate(ENDS):
            along = (end - begin) / np.hypot(*(end - begin))
            dx, dy = way_x - begin[0], way_y - begin[1]
            seen_from = dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]
            beyond = distance(*seen_from, float(np.hypot(*(end - begin)))) - radius
            inside = np.zeros(len(shares), dtype=bool)
            for first, last in spans[beam]:
                inside |= (first <= time[:, 0]) & (time[:, 0] <= last)
            slack = 1e-6  # m, largest deviation of eight chords from such paths
            assert inside[((beyond < -slack) & (ids >= 0)).any(axis=1)].all()
            assert not inside[((beyond > slack) | (ids < 0)).all(axis=1)].any()
            whole = spans[beam].shape[0] == 1 and spans[beam].tolist() == [[0.0, LENGTH]]
            assert state[beam] == (BLOCKED if whole else CHANGES if len(spans[beam]) else FREE)
            seen[state[beam]] += 1
    assert min(seen) > 20

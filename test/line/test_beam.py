"""Ways through a tick, and when on them a circle crosses a segment: against sampling and closed forms."""

from __future__ import annotations

import numpy as np
from scenes import NO_FLOOR, bottle, scene
from worlds import state_of

from conveyor_sim.line.beam import within_reach
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.motion import CHORDS, Motion
from conveyor_sim.line.timer import Timer


def distance(along: np.ndarray, aside: np.ndarray, length: np.ndarray) -> np.ndarray:
    """From points to a segment."""
    return np.hypot(along - np.clip(along, 0.0, length), aside)


def test_a_chord_is_within_reach_from_where_to_where() -> None:
    """Random chords and segments, some along it, some that stand: the bounds, and a sample of points between."""
    rng = np.random.default_rng(5)
    k = 4000
    along, aside = rng.uniform(-1.5, 2.5, (2, k)), rng.uniform(-1.5, 1.5, (2, k))
    aside[1, :400] = aside[0, :400]
    along[1, 400:800] = along[0, 400:800]
    along[1, 800:1000], aside[1, 800:1000] = along[0, 800:1000], aside[0, 800:1000]
    length, radius = rng.uniform(0.0, 1.5, k), rng.uniform(0.05, 0.8, k)
    (enter,), (leave,) = within_reach(along, aside, length, radius)
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


def test_a_way_is_the_cubic_through_its_ends() -> None:
    """Exact for constant and for evenly changing acceleration; what stands stays to the last bit."""
    c = np.array([[0.1, 0.5, 3.0, -40.0], [0.3, -0.2, 1.0, 70.0], [0.7, 0.0, 0.0, 0.0]])
    h = 0.01
    state = state_of(scene(bottles=[bottle(9.0, 9.0)], **NO_FLOOR), [[x, 0.1] for x in c[:, 0]], lists=False)
    now = ScanContext(state, h, np.empty(0), np.empty(0))
    bottles = state.world.bottles
    bottles.vx[:3] = c[:, 1]
    motion = Motion()
    motion.begin(now)
    bottles.x[:3] = c @ h ** np.arange(4)
    bottles.vx[:3] = c[:, 1:] @ (np.arange(1, 4) * h ** np.arange(3))
    motion.end(now)
    x, y = motion.points(np.arange(3))
    times = np.linspace(0.0, h, CHORDS + 1)
    np.testing.assert_allclose(x, (c @ times ** np.arange(4)[:, None]).T, rtol=0.0, atol=1e-15)
    assert (x[:, 2] == 0.7).all() and (y == 0.1).all()
    hull = motion.hull(np.arange(3))[0]
    assert (hull.min(axis=0) <= x.min(axis=0)).all() and (hull.max(axis=0) >= x.max(axis=0)).all()
    boxes = np.array([[0.2, -1.0], [5.0, 5.0]]), np.array([[0.25, 1.0], [6.0, 6.0]])
    assert motion.near(*boxes, bottles.radius).tolist() == [[0], [1]]


def test_a_timer_ignores_what_is_too_short_and_keeps_exact_times() -> None:
    timer = Timer(on=0.03, off=0.05)
    timer.start(False)
    short, long = [(0.10, True), (0.12, False)], [(0.20, True), (0.23, False)]
    assert timer.follow(short, 0.19) == []
    assert timer.follow(long[:1], 0.229) == []
    assert timer.follow([], 0.23) == [(0.23, True)]
    assert timer.follow(long[1:], 0.25) == []
    # A pulse exactly as long as the delay counts; one that ends as late as it would ripen still lets it ripen first.
    assert timer.follow([(0.26, True), (0.27, False)], 0.31) == []
    assert timer.follow([], 0.4) == [(0.32, False)]
    at_once = Timer(0.0, 0.0)
    assert at_once.follow([(0.5, True), (0.5, False), (0.7, True)], 1.0) == [(0.5, True), (0.5, False), (0.7, True)]

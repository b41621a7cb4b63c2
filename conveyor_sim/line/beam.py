"""`Beams`: from when to when in a tick a bottle's circle crossed each of some segments."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.motion import CHORDS, Motion
from conveyor_sim.scene.types import XY

ROUNDING = 1e-9
"""s; shorter than this is nothing."""

STILL = 1e-13
"""m; a bottle that moves by less in a chord stands."""

Span = tuple[float, float]
"""From and to, s."""


class Beams(Device):
    """All beams at once, for what a call of numpy costs is the most of it."""

    def __init__(self, ends: Sequence[tuple[XY, XY]], motion: Motion) -> None:
        """ends: of each beam, m."""
        super().__init__("beams")
        self._motion = motion
        start, end = np.array(ends).swapaxes(0, 1)
        self._start, self._low, self._high = start, np.minimum(start, end), np.maximum(start, end)
        self._length = np.hypot(*(end - start).T)
        self._along = (end - start) / self._length[:, None]
        self._spans: list[list[Span]] = [[] for _ in ends]

    def end(self, now: ScanContext) -> None:
        """Find out when in this tick each was blocked."""
        self._spans = [[] for _ in self._spans]
        radius = now.state.world.bottles.radius
        beam, slot = self._motion.near(self._low, self._high, radius)
        if not beam.size:
            return
        # What is within reach of a segment is convex: a way whose hull is in it is in it all the time.
        along, aside = self._seen_from(beam, *self._motion.hull(slot))
        beside = np.hypot(along - np.clip(along, 0.0, self._length[beam]), aside)
        throughout = (beside <= radius[slot]).all(axis=0)
        blocked = np.zeros(len(self._spans), dtype=bool)
        blocked[beam[throughout]] = True
        for owner in np.flatnonzero(blocked):
            self._spans[owner].append((0.0, now.length))
        rest = ~blocked[beam]
        if rest.any():
            self._follow(beam[rest], slot[rest], radius, now.length)

    def _follow(self, beam: NDArray[np.intp], slot: NDArray[np.intp], radius: F8, length: float) -> None:
        """Find the spans of some pairs of beam and slot."""
        along, aside = self._seen_from(beam, *self._motion.points(slot))
        enter, leave = within_reach(along, aside, self._length[beam], radius[slot])
        chord, pair = np.nonzero(enter <= leave)
        part = length / CHORDS
        begins, ends = (chord + enter[chord, pair]) * part, (chord + leave[chord, pair]) * part
        order = np.lexsort((begins, beam[pair]))
        columns = (beam[pair][order].tolist(), begins[order].tolist(), ends[order].tolist())
        for owner, begin, end in zip(*columns, strict=True):
            spans = self._spans[owner]
            if spans and begin <= spans[-1][1] + ROUNDING:
                spans[-1] = (spans[-1][0], max(end, spans[-1][1]))
            else:
                spans.append((begin, end))

    def _seen_from(self, beam: NDArray[np.intp], x: F8, y: F8) -> tuple[F8, F8]:
        """Points (n, k) as seen from the start of k beams: along the beam, and to the left of it."""
        x, y = x - self._start[beam, 0], y - self._start[beam, 1]
        ahead, across = self._along[beam].T
        return x * ahead + y * across, y * ahead - x * across

    def spans(self, beam: int) -> list[Span]:
        """When in this tick a beam was blocked, in order, s from its begin on; those that meet are one."""
        return self._spans[beam]


def within_reach(along: F8, aside: F8, length: F8, radius: F8) -> tuple[F8, F8]:
    """Shares of each chord at which a point comes within a radius of a segment and leaves; enter > leave if never.

    along, aside: ends of chords (chords + 1, k), m, seen from the segment's start; length, radius: (k,), m. What is
    within a radius of a segment is convex (two discs and a rectangle), so a chord has one such stretch.
    """
    u, v = np.diff(along, axis=0), np.diff(aside, axis=0)
    still = np.hypot(u, v) <= STILL
    u, v = np.where(still, 0.0, u), np.where(still, 0.0, v)
    a, b = along[:-1], aside[:-1]
    enter, leave = np.full(a.shape, np.inf), np.full(a.shape, -np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        in_length, in_width = _slab(a, u, np.zeros_like(length), length), _slab(b, v, -radius, radius)
        rectangle = np.maximum(in_length[0], in_width[0]), np.minimum(in_length[1], in_width[1])
        for first, last in (rectangle, _disc(a, b, u, v, radius), _disc(a - length, b, u, v, radius)):
            first, last = np.maximum(first, 0.0), np.minimum(last, 1.0)
            some = first <= last
            enter = np.where(some, np.minimum(enter, first), enter)
            leave = np.where(some, np.maximum(leave, last), leave)
    return enter, leave


def _slab(place: F8, way: F8, low: F8, high: F8) -> tuple[F8, F8]:
    """From which share of its way on, and up to which, a coordinate is in [low, high]."""
    one, other = (low - place) / way, (high - place) / way
    inside = (low <= place) & (place <= high)
    first = np.where(way == 0.0, np.where(inside, -np.inf, np.inf), np.minimum(one, other))
    return first, np.where(way == 0.0, -first, np.maximum(one, other))


def _disc(a: F8, b: F8, u: F8, v: F8, radius: F8) -> tuple[F8, F8]:
    """From which share of its way on, and up to which, a point is within a radius of the origin."""
    square, half, out = u * u + v * v, a * u + b * v, a * a + b * b - radius * radius
    root = np.sqrt(half * half - square * out)
    still = square == 0.0
    first = np.where(still, np.where(out <= 0.0, -np.inf, np.inf), (-half - root) / square)
    last = np.where(still, -first, (-half + root) / square)
    return first, last

# SPDX-License-Identifier: Apache-2.0
"""Queues reached in a run with integrator impulses, compared with the longest queue whose forces settle in time.

A queue is a chain of touching bottles: in each cluster, a shortest path between two bottles that are far apart. Its
forces need about n^2 sweeps to settle (`physics/timestep/settling.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.timestep.settling import LOAD_TIME, Settling, shown

EVERY = 1.0
"""Time between two looks at the bottles, s."""

SLACK = 2e-3
"""Largest gap over the sum of the radii at which bottles count as touching. Resting gaps are a tenth of it."""

I8 = NDArray[np.int64]
F8 = NDArray[np.float64]


@dataclass(frozen=True)
class QueueCheck:
    """Longest queue of a run with impulses, and the contacts whose forces had no time to settle."""

    bottles: int
    """In the longest queue."""
    time: float
    """Simulated time at which it was seen, s."""
    seconds: float
    """Time in which its forces settle, s."""
    longest: int
    """Bottles in the longest queue that settles within LOAD_TIME."""
    contacts: int
    """Touching pairs of bottles then."""
    beyond: int
    """Number of them in queues longer than `longest`."""

    @property
    def warning(self) -> str:
        """Sentence on contacts in queues that settle too slowly; empty without any."""
        if not self.beyond:
            return ""
        return (
            f"forces of {self.beyond} of {self.contacts} contacts at {self.time:.3g} s can't be trusted: a queue of "
            f"{self.bottles} bottles settles in about {shown(self.seconds)}, and up to {self.longest} settle within "
            f"{LOAD_TIME:g} s; more steps or sweeps help"
        )

    @property
    def sentence(self) -> str:
        """Result in words."""
        if not self.contacts:
            return "no queue was seen"
        return self.warning or (
            f"longest queue {self.bottles} bottles, which settles in about {shown(self.seconds)}; single forces in "
            "a crowd are less accurate than those on its stop"
        )

    @property
    def peak_note(self) -> str:
        """Clause on the peak force of a run in which bottles pressed on each other; empty without contacts."""
        return "peaks of impacts on pressed contacts are not resolved" if self.contacts else ""


class QueueWatch:
    """Looks for the longest queue of a run, once in EVERY seconds."""

    def __init__(self, model: Model | None) -> None:
        """Prepare a watch. It has no result if the model is unknown or has another integrator."""
        self._model = model
        self._next = 0.0
        self.check: QueueCheck | None = None
        """Result so far; None with other integrators, and before the first look."""

    def take(self, time: float, bottles: BottleColumns) -> None:
        """Take the bottles present at a time (s)."""
        model = self._model
        if model is None or model.settling is None or time < self._next:
            return
        self._next = time + EVERY * (1.0 - 1e-9)
        there = ~(bottles.impulse == 0.0)  # unknown impulses are NaN
        radius = model.type_radius[bottles.type[there]]
        found = _checked(time, bottles.x[there], bottles.y[there], radius, model.settling)
        if self.check is None or (found.beyond, found.bottles) > (self.check.beyond, self.check.bottles):
            self.check = found


def _checked(time: float, x: F8, y: F8, radius: F8, settling: Settling) -> QueueCheck:
    a, b = touching(x, y, radius)
    longest, most, beyond = settling.longest, 1 if x.size else 0, 0
    for length, contacts in queues(x.size, a, b):
        most = max(most, length)
        beyond += contacts if length > longest else 0
    return QueueCheck(most, time, settling.seconds(most), longest, a.size, beyond)


def touching(x: F8, y: F8, radius: F8) -> tuple[I8, I8]:
    """Return the pairs (P,) of bottles that touch, by index. x, y, radius: (B,), m."""
    order = np.argsort(x, kind="stable")
    xs, ys, rs = x[order], y[order], radius[order]
    reach = (1.0 + SLACK) * 2.0 * float(radius.max(initial=0.0))
    first: list[I8] = []
    second: list[I8] = []
    for step in range(1, x.size):
        apart = xs[step:] - xs[:-step]
        near = np.flatnonzero(apart <= reach)
        if not near.size:
            break
        limit = (1.0 + SLACK) * (rs[near] + rs[near + step])
        close = near[np.hypot(apart[near], ys[near + step] - ys[near]) <= limit]
        first.append(order[close])
        second.append(order[close + step])
    empty = np.zeros(0, np.int64)
    return np.concatenate([empty, *first]), np.concatenate([empty, *second])


def queues(count: int, a: I8, b: I8) -> list[tuple[int, int]]:
    """Return bottles in the queue, and contacts, of each cluster of two or more. a, b: (P,), touching bottles."""
    bottle, other = np.stack([a, b], axis=1).ravel(), np.stack([b, a], axis=1).ravel()
    others = other[np.argsort(bottle, kind="stable")].tolist()
    degree = np.bincount(bottle, minlength=count)
    ends = np.cumsum(degree).tolist()
    neighbours = [others[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]
    seen, distance = [-1] * count, [-1] * count
    found = []
    for start in np.flatnonzero(degree).tolist():
        if seen[start] >= 0:
            continue
        cluster = _by_distance(neighbours, start, seen)
        last = _by_distance(neighbours, cluster[-1], distance)[-1]
        found.append((distance[last] + 1, sum(len(neighbours[one]) for one in cluster) // 2))
    return found


def _by_distance(neighbours: list[list[int]], start: int, distance: list[int]) -> list[int]:
    """Return the bottles of a cluster, those with few contacts from one bottle to them first. Note these numbers."""
    reached = [start]
    distance[start] = 0
    for one in reached:  # the list grows
        for other in neighbours[one]:
            if distance[other] < 0:
                distance[other] = distance[one] + 1
                reached.append(other)
    return reached

# SPDX-License-Identifier: Apache-2.0
"""Entries of bottles onto belts and rounds of a closed loop, from bottle columns over time."""

from __future__ import annotations

import numpy as np

from conveyor_sim.columns.bottles import BottleColumns


class Itinerary:
    """Times at which bottles came onto belts, and returned to them.

    A bottle has returned when it comes onto a belt that it had left, with at least two other belts in between.
    """

    def __init__(self, belts: int, initial: int | None = None) -> None:
        """Start without entries.

        belts: number of belts of the line. initial: number of bottles at tick 0, which have the lowest ids; None if it
        is unknown.
        """
        self._initial = initial
        self.entries: list[list[float]] = [[] for _ in range(belts)]
        """Times by belt, s, at which a bottle came onto it from another belt or an infeed. A station that gives a
        bottle back to the belt from which it took it adds none."""
        self.returns: list[list[float]] = [[] for _ in range(belts)]
        """Entry times, s, of bottles that had been on the belt before, and on at least two other belts since."""
        self._since: dict[int, dict[int, set[int]]] = {}
        """Belts visited since, by bottle and belt."""
        self._ids = np.zeros(0, dtype=np.uint64)
        self._belt = np.zeros(0, dtype=np.int32)
        self._first: float | None = None
        self._last = 0.0

    def take(self, time: float, bottles: BottleColumns) -> None:
        """Add the next output of bottles, at `time` (s)."""
        stayed = np.zeros(len(bottles.id), dtype=bool)
        if len(self._ids):
            at = np.searchsorted(self._ids, bottles.id).clip(max=len(self._ids) - 1)
            stayed = (self._ids[at] == bottles.id) & (self._belt[at] == bottles.belt)
        for index in np.flatnonzero(~stayed & (bottles.belt >= 0)):
            bottle, belt = int(bottles.id[index]), int(bottles.belt[index])
            stood = self._first is None and (time > 0.0 or self._initial is None or bottle < self._initial)
            self._enter(bottle, belt, time, stood)
        self._ids, self._belt = bottles.id, bottles.belt
        self._first = time if self._first is None else self._first
        self._last = time

    def _enter(self, bottle: int, belt: int, time: float, stood: bool) -> None:
        since = self._since.setdefault(bottle, {})
        if since.get(belt) == set():  # it was in a station, or on the floor, and on no other belt since
            return
        if not stood:  # a bottle that stands on a belt at the start did not enter it
            self.entries[belt].append(time)
            if len(since.get(belt, ())) >= 2:
                self.returns[belt].append(time)
        for others in since.values():
            others.add(belt)
        since[belt] = set()

    def per_minute(self, times: list[float]) -> tuple[float, float]:
        """Return the rates over the complete time and over its second half, 1/min."""
        if self._first is None or self._last <= self._first:
            return 0.0, 0.0
        span = self._last - self._first
        late = sum(time > self._first + 0.5 * span for time in times)
        return 60.0 * len(times) / span, 120.0 * late / span

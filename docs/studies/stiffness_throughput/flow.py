# SPDX-License-Identifier: Apache-2.0
"""Metrics of the flow through a line: throughput, dwell time, jams, and the largest overlap of a contact.

Throughput and jams count from START on, dwell times of all bottles that pass. A passage is a bottle that leaves the
line. Bottles of the paper's plant stay on it; there a passage is a bottle that comes onto the first bend, and its dwell
time began when it came onto the table.
"""

from __future__ import annotations

import math
from statistics import fmean

import numpy as np

from conveyor_sim import Simulation
from conveyor_sim.run.force_check import achieved
from conveyor_sim.studies.gauges import PeakForce

INTERVAL = 5
"""Ticks from one look at the bottles to the next. 50 ms is a fiftieth of the shortest transit."""

START = 12.0
"""s, from which throughput and jams count: the first bottles have reached the narrow place."""

JAM = 5.0
"""Time without a passage that counts as a jam, s: five to ten usual gaps between passages."""

TABLE, BEND = "table", "bend_1"


class _Passages:
    """Times of passages and dwell times."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        belts = list(simulation.model.belts)
        self._loop = (belts.index(TABLE), belts.index(BEND)) if simulation.scene.name == "paper_plant" else None
        self._since: dict[int, float] = {}
        self._belt: dict[int, int] = {}
        self.times: list[float] = []
        self.dwell: list[float] = []
        self._look()

    def after_tick(self) -> None:
        """Look at the bottles now and then."""
        if self._simulation.tick % INTERVAL == 0:
            self._look()

    def _look(self) -> None:
        bottles, now = self._simulation.bottles(), self._simulation.time
        present = dict(zip(bottles.id.tolist(), bottles.belt.tolist(), strict=True))
        if self._loop is None:
            for bottle in self._since.keys() - present.keys():
                self._pass(bottle, now)
            for bottle in present:
                self._since.setdefault(bottle, now)
            return
        table, bend = self._loop
        for bottle, belt in present.items():
            before = self._belt.get(bottle)
            if belt == table and before != table and bottle not in self._since:
                self._since[bottle] = now
            elif belt == bend and before not in (None, bend):
                self._pass(bottle, now)
        self._belt = present

    def _pass(self, bottle: int, now: float) -> None:
        if now >= START:
            self.times.append(now)
        if (since := self._since.pop(bottle, None)) is not None:
            self.dwell.append(now - since)


class Throughput(_Passages):
    """Passages per minute."""

    unit = "1/min"

    def value(self) -> float:
        """Return the mean over the time from START on."""
        return 60.0 * len(self.times) / (self._simulation.time - START)


class Dwell(_Passages):
    """Mean dwell time of bottles that have passed."""

    unit = "s"

    def value(self) -> float:
        """Return the mean, NaN without such a bottle."""
        return fmean(self.dwell) if self.dwell else math.nan


class Jammed(_Passages):
    """1 for a run with a jam, else 0: for JAM seconds no bottle passed."""

    unit = "1"

    def value(self) -> float:
        """Return 1 or 0."""
        gaps = np.diff([START, *self.times, self._simulation.time])
        return float(gaps.max() >= JAM)


class PeakOverlap:
    """Overlap over the smaller diameter at the largest force, as `run` computes it."""

    unit = "1"

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._peak = simulation, PeakForce(simulation)

    def after_tick(self) -> None:
        """Observe the peaks of a tick."""
        self._peak.after_tick()

    def value(self) -> float:
        """Return the ratio."""
        check = achieved(self._simulation.model, self._peak.value())
        return math.nan if check is None else check.overlap


class DeepestOverlap:
    """Overlap over the smaller diameter that the deepest contact reaches, seen at the ticks of INTERVAL."""

    unit = "1"

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._deepest = simulation, 0.0
        self._least = 2.0 * float(simulation.model.type_radius.min())

    def after_tick(self) -> None:
        """Look at the contacts now and then."""
        if self._simulation.tick % INTERVAL == 0:
            self._deepest = max(self._deepest, float(self._simulation.contacts().overlap.max(initial=0.0)))

    def value(self) -> float:
        """Return the ratio."""
        return self._deepest / self._least

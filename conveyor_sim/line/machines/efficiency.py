# SPDX-License-Identifier: Apache-2.0
"""Efficiency of machines from counted times and cycles: the indicators of ISO 22400-2, and MTBF and MTTR.

The quotients are those of ISO 22400-2 as cited in OPC 40501-1, C.2.4; the text of the standard was not available. Its
mean times between failures and to repair may divide by the number of failures plus one. Here they divide by the number
of failures, as textbooks on reliability do. 0 / 0 is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

Category = Literal["running", "starved", "blocked", "down", "planned", "idle"]
"""running: works on bottles; starved: no bottle arrives; blocked: no bottle can leave; down: has failed, until it is
repaired; planned: planned stop; idle: stopped, or not started."""

CATEGORIES: tuple[Category, ...] = get_args(Category)


class TimeAccount:
    """Time of one machine by category, in ticks. Sums change only with the category.

    Public attributes are stored in checkpoints.
    """

    category: Category
    """Present category."""
    ticks: dict[str, int]
    """Ticks by category, up to the last change."""

    def __init__(self, category: Category, rate: float) -> None:
        """Start at tick 0.

        rate: set rate, 1/s.
        """
        self.category = category
        self.rate = rate
        """Present set rate, 1/s."""
        self.since = 0
        """Tick of the last change of category or rate."""
        self.ticks = dict.fromkeys(CATEGORIES, 0)
        self.set_work = 0.0
        """Sum of set rate x ticks running, up to the last change."""

    def change(self, tick: int, category: Category) -> None:
        """Change the category at a tick. Without effect if it is the present one."""
        if category != self.category:
            self._close(tick)
            self.category = category

    def change_rate(self, tick: int, rate: float) -> None:
        """Change the set rate (1/s) at a tick. Without effect if it is the present one."""
        if rate != self.rate:
            self._close(tick)
            self.rate = rate

    def up_to(self, tick: int) -> dict[str, int]:
        """Return the ticks by category, the present category included."""
        return {**self.ticks, self.category: self.ticks[self.category] + tick - self.since}

    def ticks_of(self, category: Category, tick: int) -> int:
        """Return the ticks in one category up to a tick."""
        return self.ticks[category] + (tick - self.since if category == self.category else 0)

    def set_work_up_to(self, tick: int) -> float:
        """Return the sum of set rate x ticks running."""
        return self.set_work + (self.rate * (tick - self.since) if self.category == "running" else 0.0)

    def _close(self, tick: int) -> None:
        self.set_work = self.set_work_up_to(tick)
        self.ticks = self.up_to(tick)
        self.since = tick


DEFINITIONS: Mapping[str, str] = {
    "busy": "planned busy time (PBT): all time but planned stops",
    "availability": "time running / planned busy time (APT / PBT)",
    "effectiveness": "completed cycles / (fastest permitted rate x time running) (PRI x PQ / APT)",
    "set_effectiveness": "completed cycles / cycles at the set rate in the time running",
    "quality": "good / processed bottles (GQ / PQ)",
    "oee": "availability x effectiveness x quality",
    "mtbf": "time running / failures",
    "mttr": "time down / failures",
}
"""Definition of each figure, for pages and reports."""


@dataclass(frozen=True)
class Efficiency:
    """Indicators of one machine over an interval. NaN before there are data."""

    availability: float
    effectiveness: float
    """Against the fastest permitted rate."""
    set_effectiveness: float
    """Against the set rate."""
    quality: float
    mtbf: float
    """Mean time between failures, s; infinite if the machine ran without a failure."""
    mttr: float
    """Mean time to repair, s."""

    @property
    def oee(self) -> float:
        """Overall equipment effectiveness."""
        return self.availability * self.effectiveness * self.quality


@dataclass(frozen=True)
class CycleSums:
    """Work of one machine, or of machines in parallel, over an interval."""

    cycles: float
    """Completed cycles. Of one that had begun before the interval: the part within it."""
    set_cycles: float
    """Cycles at the set rate in the time running."""
    rate: float
    """Fastest permitted rate, 1/s: the reference."""
    good: int
    """Good bottles among `made`."""
    made: int
    failures: float
    """Failures per machine."""


def efficiency(times: Mapping[str, float], work: CycleSums) -> Efficiency:
    """Return the indicators over an interval. times: s, by category."""
    running = times["running"]
    return Efficiency(
        availability=quotient(running, busy(times)),
        effectiveness=quotient(work.cycles, work.rate * running),
        set_effectiveness=quotient(work.cycles, work.set_cycles),
        quality=quotient(work.good, work.made),
        mtbf=quotient(running, work.failures),
        mttr=quotient(times["down"], work.failures) if work.failures else math.nan,
    )


def busy(times: Mapping[str, float]) -> float:
    """Return the planned busy time, s: all time except planned stops."""
    return sum(times.values()) - times["planned"]


def quotient(part: float, whole: float) -> float:
    """Return part / whole; x / 0 is infinite, 0 / 0 is NaN."""
    return part / whole if whole else math.inf if part else math.nan

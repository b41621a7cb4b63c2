# SPDX-License-Identifier: Apache-2.0
"""Efficiency of machines from counted times and bottles: the indicators of ISO 22400-2, and MTBF and MTTR.

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

    def __init__(self, category: Category, tick: int = 0) -> None:
        """Start in a category."""
        self.category = category
        self.since = tick
        """Tick of the last change or reset."""
        self.reset(tick)

    def reset(self, tick: int) -> None:
        """Reset all times to 0 at a tick. The category stays."""
        self.since = tick
        self.ticks = dict.fromkeys(CATEGORIES, 0)

    def change(self, tick: int, category: Category) -> None:
        """Change the category at a tick. Without effect if it is the present one."""
        if category != self.category:
            self.ticks[self.category] += tick - self.since
            self.category, self.since = category, tick

    def up_to(self, tick: int) -> Mapping[str, int]:
        """Return the ticks by category since the reset, the present category included."""
        return {**self.ticks, self.category: self.ticks[self.category] + tick - self.since}


DEFINITIONS: Mapping[str, str] = {
    "busy": "planned busy time (PBT): all time but planned stops",
    "availability": "time running / planned busy time (APT / PBT)",
    "effectiveness": "processed bottles / (nominal rate x time running) (PRI x PQ / APT)",
    "quality": "good / processed bottles (GQ / PQ)",
    "oee": "availability x effectiveness x quality: good bottles / (nominal rate x planned busy time)",
    "mtbf": "time running / failures",
    "mttr": "time down / failures",
}
"""Definition of each figure, for pages and reports."""


@dataclass(frozen=True)
class Efficiency:
    """Indicators of one machine over an interval. NaN before there are data."""

    availability: float
    effectiveness: float
    quality: float
    mtbf: float
    """Mean time between failures, s; infinite if the machine ran without a failure."""
    mttr: float
    """Mean time to repair, s."""

    @property
    def oee(self) -> float:
        """Overall equipment effectiveness."""
        return self.availability * self.effectiveness * self.quality


def efficiency(times: Mapping[str, float], processed: int, defective: int, failures: float, rate: float) -> Efficiency:
    """Return the indicators of one machine over an interval.

    times: s, by category of `time_account`. rate: nominal, 1/s. The other arguments are counts over the same interval.
    """
    running = times["running"]
    return Efficiency(
        availability=quotient(running, busy(times)),
        effectiveness=quotient(processed, rate * running),
        quality=quotient(processed - defective, processed),
        mtbf=quotient(running, failures),
        mttr=quotient(times["down"], failures) if failures else math.nan,
    )


def busy(times: Mapping[str, float]) -> float:
    """Return the planned busy time, s: all time except planned stops."""
    return sum(times.values()) - times["planned"]


def quotient(part: float, whole: float) -> float:
    """Return part / whole; x / 0 is infinite, 0 / 0 is NaN."""
    return part / whole if whole else math.inf if part else math.nan

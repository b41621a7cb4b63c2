"""Efficiency of machines from counted times and bottles: the indicators of ISO 22400-2, and MTBF and MTTR.

The quotients are those of ISO 22400-2 as OPC 40501-1, C.2.4, cites them; the standard's own text was not at hand. Its
mean times between failures and to repair may divide by one more than the number of failures; here they divide by that
number, as textbooks on reliability do. A quotient of nothing is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

DEFINITIONS: Mapping[str, str] = {
    "busy": "planned busy time (PBT): all time but planned stops",
    "availability": "time running / planned busy time (APT / PBT)",
    "effectiveness": "processed bottles / (nominal rate x time running) (PRI x PQ / APT)",
    "quality": "good / processed bottles (GQ / PQ)",
    "oee": "availability x effectiveness x quality: good bottles / (nominal rate x planned busy time)",
    "mtbf": "time running / failures",
    "mttr": "time down / failures",
}
"""What each figure is, for pages and reports."""


@dataclass(frozen=True)
class Efficiency:
    """Of one machine over some time; NaN where nothing is known yet."""

    availability: float
    effectiveness: float
    quality: float
    mtbf: float
    """s; infinite if it ran and has not failed."""
    mttr: float
    """s"""

    @property
    def oee(self) -> float:
        """Overall equipment effectiveness."""
        return self.availability * self.effectiveness * self.quality


def efficiency(times: Mapping[str, float], processed: int, defective: int, failures: float, rate: float) -> Efficiency:
    """times: s by category, as `time_account` has them; rate: nominal, 1/s; the rest: counted over the same time."""
    running = times["running"]
    return Efficiency(
        availability=quotient(running, busy(times)),
        effectiveness=quotient(processed, rate * running),
        quality=quotient(processed - defective, processed),
        mtbf=quotient(running, failures),
        mttr=quotient(times["down"], failures) if failures else math.nan,
    )


def busy(times: Mapping[str, float]) -> float:
    """Planned busy time, s: all but planned stops."""
    return sum(times.values()) - times["planned"]


def quotient(part: float, whole: float) -> float:
    """part / whole; infinite for something of nothing, NaN for nothing of nothing."""
    return part / whole if whole else math.inf if part else math.nan

# SPDX-License-Identifier: Apache-2.0
"""Time periods of machines by category and stop reason."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Period(NamedTuple):
    """Time that a machine spent in one category, for one reason."""

    machine: str
    begin: float
    """s, simulated."""
    end: float
    """s"""
    category: str
    """Time category of `line/machines/efficiency.py`."""
    reason: str
    """Why it was down, idle or stopped by plan; "" else."""

    @property
    def length(self) -> float:
        """Return the length, s."""
        return self.end - self.begin

    @property
    def is_after(self) -> bool:
        """True if its reason is over, and the machine has not been started again."""
        return _is_after(self.category, self.reason)

    @property
    def why(self) -> str:
        """The reason, or else the category."""
        return _why(self.category, self.reason)


class StopReason(NamedTuple):
    """All stops of one machine for one reason."""

    machine: str
    category: str
    reason: str
    stops: int
    length: float
    """s, in all."""

    @property
    def why(self) -> str:
        """The reason, or else the category."""
        return _why(self.category, self.reason)


def _is_after(category: str, reason: str) -> bool:
    """Return True for a failure, a planned stop or an Abort whose machine is idle after it."""
    return (
        category == "idle" and bool(reason) and (not reason.startswith("command") or reason.startswith("command Abort"))
    )


def _why(category: str, reason: str) -> str:
    """Return the reason in words."""
    return f"after {reason}" if _is_after(category, reason) else reason or category


def stop_reasons(periods: Iterable[Period]) -> list[StopReason]:
    """Periods in which machines did not run, by machine and reason, those that took longest first."""
    sums: dict[tuple[str, str, str], list[float]] = {}
    for period in periods:
        if period.category != "running":
            entry = sums.setdefault((period.machine, period.category, period.reason), [0.0, 0.0])
            entry[0] += 1
            entry[1] += period.length
    found = [StopReason(*key, int(stops), length) for key, (stops, length) in sums.items()]
    return sorted(found, key=lambda entry: (-entry.length, entry))


def longest_stops(periods: Iterable[Period], most: int) -> list[Period]:
    """Return the longest periods in which machines did not run, the longest first."""
    stops = (period for period in periods if period.category != "running")
    return sorted(stops, key=lambda period: (-period.length, period))[:most]


def shares(periods: Sequence[Period], categories: Sequence[str], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of each category in each interval between `edges` (n + 1,), s; (categories, n)."""
    found = np.zeros((len(categories), len(edges) - 1))
    for row, category in enumerate(categories):
        mine = [period for period in periods if period.category == category]
        if mine:
            # Time in the category up to any moment: it grows within periods and stands between them.
            at = np.array([moment for period in mine for moment in (period.begin, period.end)])
            grown = np.cumsum([length for period in mine for length in (0.0, period.length)])
            found[row] = np.diff(np.interp(edges, at, grown)) / np.diff(edges)
    return found

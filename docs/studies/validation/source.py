# SPDX-License-Identifier: Apache-2.0
"""One published source of the validation: the interface that each module of this folder fills with `SOURCE`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from conveyor_sim.statistics.intervals import mean_interval, t_quantile

Case = Mapping[str, str | float]
"""Parameters of one run, the seed included; flat, because they are columns of the CSV file."""

Run = Mapping[str, Any]
"""One stored run: its case, its results, and `cpu_s`; numbers as float, everything else as text."""


class Range(NamedTuple):
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def exact(cls, value: float) -> Range:
        """Return a value that is stated without an error: a closed form, or a number in a text."""
        return cls(value, value, value)

    @classmethod
    def within(cls, value: float, half_width: float) -> Range:
        """Return a value with half the length of its interval, such as a digitised mark and its reading error."""
        return cls(value, value - half_width, value + half_width)

    @classmethod
    def bounds(cls, low: float, high: float) -> Range:
        """Return an interval of which the source states only the ends."""
        return cls(0.5 * (low + high), low, high)

    @classmethod
    def above(cls, low: float) -> Range:
        """Return the claim that a value is larger than `low`."""
        return cls(low, low, math.inf)

    @classmethod
    def below(cls, high: float) -> Range:
        """Return the claim that a value is smaller than `high`."""
        return cls(high, -math.inf, high)

    @classmethod
    def of_mean(cls, values: ArrayLike) -> Range:
        """Return the mean of independent values (n,), with Student's interval; infinite for one value."""
        interval = mean_interval(np.asarray(values, dtype=float))
        return cls(interval.mean, interval.low, interval.high)

    @classmethod
    def of_share(cls, hits: int, runs: int) -> Range:
        """Return the probability of an event that `hits` of `runs` show, with the interval of Wilson (1927)."""
        z = 1.959964
        share = hits / runs
        middle = (share + z * z / (2.0 * runs)) / (1.0 + z * z / runs)
        half = z * math.sqrt(share * (1.0 - share) / runs + z * z / (4.0 * runs * runs)) / (1.0 + z * z / runs)
        return cls(share, min(share, max(0.0, middle - half)), max(share, min(1.0, middle + half)))

    @classmethod
    def of_slope(cls, x: ArrayLike, y: ArrayLike) -> Range:
        """Return the slope of the straight line through points (n,), by least squares, n > 2."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        dx = x - x.mean()
        slope = float(dx @ y / (dx @ dx))
        rest = y - y.mean() - slope * dx
        half = t_quantile(len(x) - 2, 0.95) * math.sqrt(float(rest @ rest) / (len(x) - 2) / float(dx @ dx))
        return cls.within(slope, half)

    @classmethod
    def of_ratio(cls, values: ArrayLike, base: ArrayLike) -> Range:
        """Return mean(values) / mean(base) of independent values, with the interval from the logarithms' means."""
        over, under = mean_interval(np.log(np.asarray(values))), mean_interval(np.log(np.asarray(base)))
        middle, half = over.mean - under.mean, math.hypot(over.half_width, under.half_width)
        return cls(math.exp(middle), math.exp(middle - half), math.exp(middle + half))

    def overlaps(self, other: Range) -> bool:
        """Return True if both intervals share a value, up to the six digits that are stored."""
        room = 1e-6 * max(abs(self.value), abs(other.value))
        return self.low <= other.high + room and other.low <= self.high + room


@dataclass(frozen=True)
class Row:
    """One published figure beside the simulated one."""

    quantity: str
    """Name, condition and unit."""
    published: Range
    simulated: Range | None
    """None if the runs of this figure have not been made."""
    origin: str = ""
    """Where the published figure stands: abstract, text, figure, table."""

    @property
    def verdict(self) -> str:
        """Return `agrees` if the 95 % intervals overlap, `disagrees` if not, `not run` without a simulated value."""
        if self.simulated is None or math.isnan(self.simulated.value):
            return "not run"
        return "agrees" if self.simulated.overlaps(self.published) else "disagrees"


@dataclass(frozen=True)
class Source:
    """One published source: what it measured, how it is simulated, and how both are compared."""

    name: str
    """Name of the module, of the CSV file and of the picture."""
    title: str
    """Subject in a few words, for headings."""
    citation: str
    read: str
    """Parts of the source that were read: all, the abstract, a figure; `validation notes` for second-hand figures."""
    measured: str
    """Set-up and result of the publication."""
    simulated: str
    """Scene, materials, sizes, numbers of runs, and deviations from the published set-up."""
    cases: Callable[[], Sequence[Case]]
    """Return the runs of this source; independent of each other, all with the same keys."""
    simulate: Callable[[Case], Mapping[str, float]]
    """Run one case and return its results; deterministic, at module level (it is called in another process)."""
    rows: Callable[[Sequence[Run]], Sequence[Row]]
    """Compare the stored runs with the publication. Also called while some runs are missing."""
    seconds: float
    """Estimated processor time of one run, s, kernels compiled."""
    discussion: str = ""
    """Reasons of misses, and what would have to be measured to decide them."""
    draw: Callable[[Sequence[Run]], Figure] | None = None
    """Draw the picture of this source; None without one."""
    caption: str = ""
    """Description of the picture."""

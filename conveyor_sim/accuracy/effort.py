# SPDX-License-Identifier: Apache-2.0
"""Budget of processor time of a study, and the progress display that shows what is left of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Protocol


class Bar(Protocol):
    """Progress of one stage."""

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        """Take in what is done, the whole, and the time left (s), where it is known."""


Bars = Callable[[str, str], AbstractContextManager[Bar]]
"""Opens the bar of a stage: what it does, and what is counted."""


PROCESSORS = 2
"""Free ones that a study counts on: while one process measures, the other processor is idle."""


@dataclass(frozen=True)
class Effort:
    """Extent of a study."""

    budget: float
    """s of processor time on PROCESSORS processors together, idle ones included and compiling left out."""
    measuring: float = math.inf
    """s of processor time after which no further setting is measured; long runs get what is left."""

    def long_runs(self, measured: float) -> float:
        """Return the processor time for long runs, s, if measuring took `measured` seconds on one processor."""
        return max(0.0, self.budget - PROCESSORS * measured)

    @property
    def limit(self) -> float:
        """Wall time within which a study ends on PROCESSORS free processors, s; compiling left out."""
        return self.budget / PROCESSORS + RESERVE


RESERVE = 40.0
"""s of wall time for work that begins within the budget and ends after it: the last setting that is measured, first
runs, which are made in any case, and the last runs, beside which a processor is idle."""

DEFAULT = Effort(budget=PROCESSORS * 260.0, measuring=120.0)
"""Its limit is the 300 s that are promised on two free processors."""
THOROUGH = Effort(budget=6000.0)


class TimeLeft:
    """Upper bound of the time left of a study on PROCESSORS free processors. It never grows.

    It is the limit of the effort less the time spent in all phases so far, so it covers the phases that follow.
    Measuring occupies all processors, a long run occupies one.
    """

    def __init__(self, effort: Effort) -> None:
        self._limit = self._bound = effort.limit
        self._measured = self._runs = 0.0

    def after_measuring(self, measured: float) -> float | None:
        """Return the bound (s) after `measured` seconds of measuring; see `after_runs`."""
        self._measured = measured
        return self.after_runs(0.0)

    def after_runs(self, spent: float) -> float | None:
        """Return the bound (s) after long runs of `spent` seconds of processor time.

        None once the limit is exceeded.
        """
        self._runs = spent
        self._bound = min(self._bound, self._limit - self._spent)
        return self._bound if self._bound > 0.0 else None

    def at_most(self, bound: float) -> None:
        """Lower the bound to `bound` seconds from now on. A greater value has no effect."""
        self._limit = min(self._limit, self._spent + bound)

    @property
    def _spent(self) -> float:
        """Wall time on free processors, s."""
        return self._measured + self._runs / PROCESSORS


def bars_with_left(bars: Bars, left: Callable[[], float | None]) -> Bars:
    """Bars that show the time left (s) of the whole study with each update."""

    @contextmanager
    def opened(what: str, counted: str) -> Iterator[Bar]:
        with bars(what, counted) as bar:
            yield _BarWithLeft(bar, left)

    return opened


class _BarWithLeft:
    def __init__(self, bar: Bar, left: Callable[[], float | None]) -> None:
        self._bar = bar
        self._left = left

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        self._bar.update(done, total, self._left())

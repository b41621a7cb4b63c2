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


DEFAULT = Effort(budget=PROCESSORS * 260.0, measuring=120.0)
"""Less than the 300 s that are promised of two free processors: starting, loading kernels and drawing come on top."""
THOROUGH = Effort(budget=6000.0)


def bars_with_left(bars: Bars, left: Callable[[], float]) -> Bars:
    """Bars that show the time left (s) of the whole study with each update."""

    @contextmanager
    def opened(what: str, counted: str) -> Iterator[Bar]:
        with bars(what, counted) as bar:
            yield _BarWithLeft(bar, left)

    return opened


class _BarWithLeft:
    def __init__(self, bar: Bar, left: Callable[[], float]) -> None:
        self._bar = bar
        self._left = left

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        known = self._left()
        self._bar.update(done, total, known if math.isfinite(known) else left)

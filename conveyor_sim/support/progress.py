# SPDX-License-Identifier: Apache-2.0
"""Progress of a run: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, Task, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

PLAIN_SHARE = 0.1
"""Share of the total after which another line is printed if there is no terminal."""

SILENCE = 2.0
"""Wall time without output after which `told_if_long` prints its sentence, s."""


@contextmanager
def told_if_long(sentence: str) -> Iterator[None]:
    """Print a sentence if the context takes longer than SILENCE."""
    timer = threading.Timer(SILENCE, print, (sentence,), {"file": sys.stderr, "flush": True})
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


class _StageLeft(TimeRemainingColumn):
    """Column with the estimated time left, empty where the caller states it."""

    def render(self, task: Task) -> Text:
        return super().render(task) if task.fields["left"] is None else Text()


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Progress in simulated time, with the real-time factor so far.

    `total`: simulated time, s. `counted`: unit that is counted instead of time, such as `rounds`.
    """

    def __init__(self, what: str, total: float, console: Console | None = None, counted: str = "") -> None:
        self._what = what
        self._total = total
        self._counted = counted
        self._console = console or Console(file=sys.stderr, markup=False)
        self._start: tuple[float, float] | None = None
        self._left: float | None = None
        self._next_line = PLAIN_SHARE * total
        self._bar: Progress | None = None
        if self._console.is_terminal:
            columns = (
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=None),
                TaskProgressColumn(),
                TextColumn("{task.fields[state]}", markup=False),
                _StageLeft(),
            )
            self._bar = Progress(*columns, console=self._console)
            self._task = self._bar.add_task(what, total=total, state="", left=None)
            self._bar.start()

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        """Show the progress. `done`: simulated time so far, s; `total`: replaces the total.

        `left`: upper bound of the wall time left, s, if the caller knows one.
        """
        self._left = left
        if self._start is None:  # building and compiling come before the first tick and would look like slowness
            self._start = (time.monotonic(), done)
        if total is not None and total != self._total:
            self._total, self._next_line = total, PLAIN_SHARE * total
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=self._total, state=self._state(done), left=left)
        elif done >= self._next_line:
            self._next_line += PLAIN_SHARE * self._total
            line = f"{self._what}: {self._state(done)}{self._estimate(done)}"
            self._console.print(line, highlight=False, soft_wrap=True)

    def _state(self, done: float) -> str:
        if self._counted:
            left = "" if self._left is None else f", at most {self._left:.0f} s left"
            digits = 0 if self._total == int(self._total) else _decimals(self._total)
            return f"{done:.{digits}f} of {self._total:.{digits}f} {self._counted}{left}"
        start, already = self._start or (time.monotonic(), done)
        digits, wall = _decimals(self._total), max(time.monotonic() - start, 1e-9)
        speed = f", {(done - already) / wall:.3g} x real time" if done > already else ""
        return f"{done:.{digits}f} of {self._total:.{digits}f} s{speed}"

    def _estimate(self, done: float) -> str:
        """Return the estimated wall time left for a line without a terminal; empty at the end, or if it is stated."""
        start, already = self._start or (time.monotonic(), done)
        if not already < done < self._total or self._left is not None:
            return ""
        return f", about {(time.monotonic() - start) * (self._total - done) / (done - already):.0f} s left"

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()


def _decimals(total: float) -> int:
    """Return the decimals in which a tenth of a total of seconds differs from 0; one for 1 s and more."""
    return 1 - min(0, math.floor(math.log10(total))) if 0.0 < total < 1.0 else 1

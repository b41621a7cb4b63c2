# SPDX-License-Identifier: Apache-2.0
"""Progress display of a running study: remaining time, and its table as it grows."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, ExitStack

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.table import points_table
from conveyor_sim.support.progress import ProgressBar

ROWS = 20
"""Points that are shown."""
INTERVAL = 0.5
"""s of wall time between two pictures of the table."""


class Display(AbstractContextManager["Display"]):
    """On a terminal the table with a line below it; elsewhere a line now and then."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._console = Console(stderr=True, markup=False, highlight=False)
        self._rows: list[RunRow] = []
        self._drawn = 0.0
        with ExitStack() as stack:
            self._live = self._bar = None
            if self._console.is_terminal:
                self._live = stack.enter_context(Live(console=self._console, auto_refresh=False, transient=True))
            else:
                self._bar = stack.enter_context(ProgressBar(setup.study.name, 0.0, self._console, "runs"))
            self._stack = stack.pop_all()

    def update(self, done: int, total: int, left: float | None, row: RunRow | None) -> None:
        """Update the display; called by `Runs.run`."""
        if row is not None:
            self._rows.append(row)
        if self._bar is not None:
            self._bar.update(done, total, left)
        now = time.monotonic()
        if self._live is not None and (now - self._drawn > INTERVAL or done == total):
            self._drawn = now
            units = {name: metric.unit for name, metric in self._setup.kept.items()}
            left_text = "" if left is None else f", about {in_words(left)} left"
            line = Text(f"{self._setup.study.name}: {done} of {total} runs{left_text}")
            self._live.update(Group(points_table(self._rows, units, {}, ROWS), line), refresh=True)

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def in_words(seconds: float) -> str:
    """Return a duration as text: "40 s", "12 min", "3.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"

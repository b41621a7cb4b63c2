# SPDX-License-Identifier: Apache-2.0
"""A controller that commands nothing and notes when it scans: what lockstep itself costs."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from conveyor_sim.control.scan import Inputs


class Counting:
    """Writes wall and processor time (s) at two of its scans, a line each."""

    def __init__(self, path: str, first: int, last: int) -> None:
        self._path = Path(path)
        self._marks = (first, last)
        self._count = 0

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """No commands."""
        self._count += 1
        if self._count in self._marks:
            with self._path.open("a") as file:
                file.write(f"{time.perf_counter()!r} {time.process_time()!r}\n")
        return {}


def make(path: str, first: int, last: int) -> Counting:
    """Build the controller, as `controller_node` does."""
    return Counting(path, first, last)

"""Processor time: what a study takes does not depend on what else the machine does, and compiling is told apart."""

from __future__ import annotations

import os
import time
from contextlib import AbstractContextManager
from types import TracebackType

from numba.core import event


def cpu_time() -> float:
    """s of processor time of this process, all threads, and of the child processes that have ended."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


class Meter(AbstractContextManager["Meter"], event.Listener):
    """What this process takes between entering and leaving."""

    def __init__(self) -> None:
        self.compiling = 0.0
        """s of processor time so far in which numba compiled."""
        self._depth = 0
        self._began = self._compile_began = 0.0

    @property
    def cpu(self) -> float:
        """s of processor time so far, compiling left out."""
        return cpu_time() - self._began - self.compiling

    def on_start(self, _event: event.Event) -> None:
        """Numba begins to compile something, perhaps inside of something else."""
        if self._depth == 0:
            self._compile_began = cpu_time()
        self._depth += 1

    def on_end(self, _event: event.Event) -> None:
        """It is done with it."""
        self._depth -= 1
        if self._depth == 0:
            self.compiling += cpu_time() - self._compile_began

    def __enter__(self) -> Meter:
        self._began = cpu_time()
        event.register("numba:compile", self)  # type: ignore[no-untyped-call]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        event.unregister("numba:compile", self)  # type: ignore[no-untyped-call]

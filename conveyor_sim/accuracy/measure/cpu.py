# SPDX-License-Identifier: Apache-2.0
"""Processor time: what a study takes does not depend on what else the machine does, and compiling is counted apart."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from conveyor_sim.engine.compiler.numba_internals.compile_time import CompileTime


def cpu_time() -> float:
    """Return the processor time, s, of all threads of this process and of its child processes that have ended."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


class _FirstCompiled(CompileTime):
    """Says so as numba begins to compile for the first time."""

    def __init__(self, compiles: Callable[[], None]) -> None:
        super().__init__(cpu_time)
        self._compiles = compiles
        self._said = False

    def on_start(self, event: Any) -> None:
        if not self._said:
            self._said = True
            self._compiles()
        super().on_start(event)


class Meter(AbstractContextManager["Meter"]):
    """Meter of the processor time of this process between entering and leaving."""

    def __init__(self, compiles: Callable[[], None] = lambda: None) -> None:
        """compiles: called as numba begins to compile for the first time."""
        self._compile_time = _FirstCompiled(compiles)
        self._began = cpu_time()

    @property
    def compiling(self) -> float:
        """Return the processor time of numba's compiler so far, s."""
        return self._compile_time.spent

    @property
    def cpu(self) -> float:
        """Return the processor time so far without compiling, s."""
        return cpu_time() - self._began - self.compiling

    def __enter__(self) -> Meter:
        self._began = cpu_time()
        self._compile_time.begin()
        return self

    def __exit__(self, *_: object) -> None:
        self._compile_time.end()

"""Processor time: what a study takes does not depend on what else the machine does, and compiling is counted apart."""

from __future__ import annotations

import os
import time
from contextlib import AbstractContextManager

from conveyor_sim.engine.compiler.compile_time import CompileTime


def cpu_time() -> float:
    """s of processor time of this process, all threads, and of the child processes that have ended."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


class Meter(AbstractContextManager["Meter"]):
    """What this process takes from entering to leaving."""

    def __init__(self) -> None:
        self._compile_time = CompileTime(cpu_time)
        self._began = cpu_time()

    @property
    def compiling(self) -> float:
        """s of processor time so far in which numba compiled."""
        return self._compile_time.spent

    @property
    def cpu(self) -> float:
        """s of processor time so far, compiling left out."""
        return cpu_time() - self._began - self.compiling

    def __enter__(self) -> Meter:
        self._began = cpu_time()
        self._compile_time.begin()
        return self

    def __exit__(self, *_: object) -> None:
        self._compile_time.end()

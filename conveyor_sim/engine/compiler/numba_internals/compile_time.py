# SPDX-License-Identifier: Apache-2.0
"""Processor time that numba spends compiling."""

from collections.abc import Callable

from numba.core import event


class CompileTime(event.Listener):
    """Processor time spent compiling between `begin` and `end`, in this process."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """clock: returns the processor time so far, s."""
        self.spent = 0.0
        """s"""
        self._clock = clock
        self._depth = 0
        self._began = 0.0

    def begin(self) -> None:
        """Start to measure."""
        event.register("numba:compile", self)

    def end(self) -> None:
        """Stop measuring."""
        event.unregister("numba:compile", self)

    def on_start(self, _event: event.Event) -> None:
        """Note the start of a compilation, possibly inside another one."""
        if self._depth == 0:
            self._began = self._clock()
        self._depth += 1

    def on_end(self, _event: event.Event) -> None:
        """Add the time of an outermost compilation."""
        self._depth -= 1
        if self._depth == 0:
            self.spent += self._clock() - self._began

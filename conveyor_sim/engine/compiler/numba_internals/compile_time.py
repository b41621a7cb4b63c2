"""Processor time that numba takes to compile, counted apart from what runs."""

from collections.abc import Callable

from numba.core import event


class CompileTime(event.Listener):
    """What compiling takes from `begin` to `end`, in this process."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """clock: s of processor time so far."""
        self.spent = 0.0
        """s"""
        self._clock = clock
        self._depth = 0
        self._began = 0.0

    def begin(self) -> None:
        """Listen from now on."""
        event.register("numba:compile", self)

    def end(self) -> None:
        """Listen no longer."""
        event.unregister("numba:compile", self)

    def on_start(self, _event: event.Event) -> None:
        """Numba begins to compile something, perhaps inside of something else."""
        if self._depth == 0:
            self._began = self._clock()
        self._depth += 1

    def on_end(self, _event: event.Event) -> None:
        """It is done with it."""
        self._depth -= 1
        if self._depth == 0:
            self.spent += self._clock() - self._began

"""Watchdogs: a belt whose controller has gone silent stops."""

from dataclasses import dataclass


@dataclass
class Watchdog:
    """Stops one belt when no command for it was accepted for `timeout` s of simulated time."""

    timeout_ticks: int
    last: int = 0
    """Tick of the last accepted command."""
    tripped: bool = False

    def command(self, tick: int) -> None:
        """A command was accepted."""
        self.last = tick
        self.tripped = False

    def trips(self, tick: int) -> bool:
        """Whether the belt must stop now: once, at the first tick past the time-out."""
        if self.tripped or tick - self.last < self.timeout_ticks:
            return False
        self.tripped = True
        return True

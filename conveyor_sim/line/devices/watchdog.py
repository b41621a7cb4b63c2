"""Watchdogs: a belt whose controller has gone silent stops."""

from dataclasses import dataclass


@dataclass
class Watchdog:
    """Stops one belt when no command for it was accepted for `timeout` s of simulated time."""

    timeout_ticks: int
    last: int = 0
    """Tick of the last accepted command."""
    tripped: bool = False
    rests: bool = False
    """While no controller is to command the belt."""

    def command(self, tick: int) -> None:
        """A command was accepted."""
        self.last = tick
        self.tripped = False

    def rest(self, tick: int, rests: bool) -> None:
        """The belt has left its controller's hands, or comes back into them, with all of the time before it."""
        self.rests = rests
        self.command(tick)

    def trips(self, tick: int) -> bool:
        """Whether the belt must stop now: once, at the first tick past the time-out."""
        if self.rests or self.tripped or tick - self.last < self.timeout_ticks:
            return False
        self.tripped = True
        return True

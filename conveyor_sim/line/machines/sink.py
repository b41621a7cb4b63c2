"""Sinks: downstream machines that take bottles at a rate. A sink without a waiting bottle is starved."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.machines.stop_reason import NONE, STARVED
from conveyor_sim.line.machines.taking import TakingDevice
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.sink import Sink


class SinkDevice(TakingDevice):
    """Sink of a running line. Starved: a bottle is due, and none is in its region."""

    def __init__(self, name: str, sink: Sink, setup: DeviceSetup) -> None:
        signals = [
            count(f"{name}/taken", "counter", "Bottles taken.", adds_to="removed"),
            count(f"{name}/taken_bad", "counter", "Bad bottles taken."),
            switch(f"{name}/starved", "status", "A bottle is due, and none is there.", adds_to="state"),
            seconds(f"{name}/starved_time", "counter", "Total time starved."),
        ]
        super().__init__(name, sink, setup, signals)
        self.removed = 0
        self.removed_bad = 0
        self.starved_ticks = 0

    def take(self, now: ScanContext) -> None:
        """Take the bottle that has waited longest, if one is due."""
        if self._busy:
            self.advance(now)
        slot_of = self.queue(now)
        cause = NONE
        if self.turn(now):
            if not self.waiting:
                cause = STARVED
                self.starved_ticks += 1
                self.wait()
            elif self.goes_on():
                first, *others = self.waiting
                now.state.remove(slot_of[first])
                self.waiting = tuple(others)
                self.removed += 1
                self.removed_bad += first in now.bad
                self.cycle -= 1.0
        self.conclude(cause, now)

    def counts(self) -> tuple[int, int, int]:
        """Return taken bottles, and bad ones among them."""
        return self.removed, self.removed_bad, 0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        starved, time = self.cause == STARVED, self.starved_ticks * now.length
        return self.works, self.removed, self.removed_bad, starved, time, *self.status()

    def states(self, now: ScanContext) -> list[float]:
        """Return running, starved, state, category and stop reason."""
        return [self.works, self.cause == STARVED, *self.condition]

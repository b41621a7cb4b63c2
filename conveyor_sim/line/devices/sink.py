"""Sinks: machines downstream that take one bottle after another at a rate, and are starved where none waits."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.machine import MachineDevice
from conveyor_sim.line.region import Region
from conveyor_sim.line.setup import Setup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.sink import Sink


class SinkDevice(MachineDevice):
    """One sink while it runs. Starved: it would take a bottle, and none is in its region."""

    waiting: tuple[int, ...]
    """Ids of the bottles in the region, in the order of their arrival."""

    def __init__(self, name: str, sink: Sink, setup: Setup) -> None:
        signals = [
            count(f"{name}/taken", "counter", "Bottles taken.", adds_to="removed"),
            count(f"{name}/taken_bad", "counter", "Bad bottles taken."),
            switch(f"{name}/starved", "status", "It would take a bottle, and none is there.", adds_to="state"),
            seconds(f"{name}/starved_time", "counter", "For how long in all it was starved."),
        ]
        super().__init__(name, sink.rate, sink.rate_limit, signals)
        self._region = Region(sink.region)
        self.waiting = ()
        self.removed = 0
        self.removed_bad = 0
        self.starved = False
        self.starved_ticks = 0

    def take(self, now: ScanContext) -> None:
        """Take the bottle that has waited longest, if one is due."""
        bottles = now.state.world.bottles
        slots = self._region.inside(bottles)
        slot_of = dict(zip(bottles.id[slots].tolist(), slots.tolist(), strict=True))
        stayed = tuple(bottle for bottle in self.waiting if bottle in slot_of)
        if stayed != self.waiting or len(stayed) < len(slot_of):
            self.waiting = (*stayed, *sorted(slot_of.keys() - set(stayed)))
        due = self.turn(now)
        self.starved = due and not self.waiting
        if self.starved:
            self.starved_ticks += 1
            self.wait()
        elif due:
            first, *others = self.waiting
            now.state.remove(slot_of[first])
            self.waiting = tuple(others)
            self.removed += 1
            self.removed_bad += first in now.bad
            self.cycle -= 1.0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Running, taken, taken_bad, starved, starved_time (s)."""
        return self.runs, self.removed, self.removed_bad, self.starved, self.starved_ticks * now.length

    def states(self, now: ScanContext) -> Sequence[float]:
        """Running and starved."""
        return self.runs, self.starved

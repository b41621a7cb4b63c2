"""Sources: machines upstream that give bottles at a rate, and are blocked where there is no room for one."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.entry import Quality
from conveyor_sim.line.machine import MachineDevice
from conveyor_sim.line.setup import MACHINES, Setup
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.source import Source


class SourceDevice(MachineDevice):
    """One source while it runs. Blocked: it would run, has a bottle to give, and there is no room for it."""

    def __init__(self, name: str, source: Source, setup: Setup) -> None:
        signals = [
            count(f"{name}/produced", "counter", "Bottles given.", adds_to="fed"),
            switch(f"{name}/blocked", "status", "It would give a bottle, and there is no room.", adds_to="state"),
            seconds(f"{name}/blocked_time", "counter", "For how long in all it was blocked."),
        ]
        super().__init__(name, source.rate, source.rate_limit, signals)
        self._position = source.position
        self._entry = setup.entry(source.bottle, source.direction, source.speed)
        random = setup.random(MACHINES, setup.index("machines", name.rpartition("/")[2]))
        self.quality = Quality(source.bad_share, source.bad_every, random)
        self.fed = 0
        self.blocked = False
        self.blocked_ticks = 0

    def feed(self, now: ScanContext) -> None:
        """Give the bottle that is due, if there is room."""
        due = self.turn(now)
        self.blocked = due and not self._entry.has_room(now.state, *self._position)
        if self.blocked:
            self.blocked_ticks += 1
            self.wait()
        elif due:
            self.quality.judge(self._entry.enter(now.state, *self._position), now)
            self.fed += 1
            self.cycle -= 1.0

    def values(self, now: ScanContext) -> Sequence[float]:
        """Running, produced, blocked, blocked_time (s)."""
        running, blocked = self.states(now)
        return running, self.fed, blocked, self.blocked_ticks * now.length

    def states(self, now: ScanContext) -> Sequence[float]:
        """Running and blocked."""
        return self.runs and not self.blocked, self.blocked

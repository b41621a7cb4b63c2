"""Machines that take bottles from a region: their queue, the fill level at which they start, and sinks."""

from collections.abc import Mapping, Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.region import Region, ZoneDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.line.machines.stop_reason import BLOCKED, NONE, STARVED
from conveyor_sim.line.tag import Tag, count, seconds, switch
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.sink import Sink

FILLS = frozenset({PackMLState.STARTING, PackMLState.UNSUSPENDING})


class TakingDevice(MachineDevice):
    """Machine that takes the bottle that has waited longest in its region."""

    waiting: tuple[int, ...]
    """Ids of the bottles in the region, in order of arrival."""

    _working = (PackMLState.EXECUTE, PackMLState.COMPLETING)

    def __init__(self, name: str, part: TakingPart, setup: DeviceSetup, own: Sequence[Tag]) -> None:
        fills = () if part.start_fill is None else FILLS
        super().__init__(name, part, setup, own, (PackMLState.COMPLETING, *fills))
        self._region = Region(part.region)
        self._fill, self._zone_name, self._setup = part.start_fill or 0, part.start_zone, setup
        self._zone: ZoneDevice | None = None
        self._run_down_ticks = setup.ticks(part.run_down)
        self.waiting = ()

    def queue(self, now: ScanContext) -> Mapping[int, int]:
        """Update `waiting`, and return the slots of the waiting bottles by their ids."""
        bottles = now.state.world.bottles
        slots = self._region.inside(bottles)
        slot_of: dict[int, int] = dict(zip(bottles.id[slots].tolist(), slots.tolist(), strict=True))
        stayed = tuple(bottle for bottle in self.waiting if bottle in slot_of)
        if stayed != self.waiting or len(stayed) < len(slot_of):
            self.waiting = (*stayed, *sorted(slot_of.keys() - set(stayed)))
        return slot_of

    def ready(self, now: ScanContext) -> bool:
        """Return True if enough bottles wait to start or resume, or if the machine has run empty.

        The latter applies in Completing: no bottle has arrived for the run-down time.
        """
        if self.state == PackMLState.COMPLETING:
            return self.cause == STARVED and self.waited >= self._run_down_ticks
        if self.state not in FILLS or (self.state == PackMLState.UNSUSPENDING and self.reason == BLOCKED):
            return True
        return self._filled(now) >= self._fill

    def _filled(self, now: ScanContext) -> int:
        if self._zone_name is None:
            return self._region.inside(now.state.world.bottles).size
        if self._zone is None:  # zones are built after machines
            self._zone = self._setup.device(ZoneDevice, f"zones/{self._zone_name}")
        return self._zone.count(now)

    def rehearse(self, now: ScanContext) -> None:
        """Search the region."""
        self._region.inside(now.state.world.bottles)


class SinkDevice(TakingDevice):
    """Downstream machine that takes bottles at a rate. Starved: a bottle is due, and none is in its region."""

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

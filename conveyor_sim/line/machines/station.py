# SPDX-License-Identifier: Apache-2.0
"""Machines that take bottles from a region: their queue, the fill level at which they start, sinks and stations.

Stations work on a bottle for one cycle, and give it back at another place.
"""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.bottle_work import BottleWork, work_tags
from conveyor_sim.line.devices.entry import Scattering, has_room, velocity
from conveyor_sim.line.devices.region import Region, ZoneDevice
from conveyor_sim.line.devices.setup import JITTER, DeviceSetup
from conveyor_sim.line.machines.machine import MachineDevice
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.line.machines.stop_reason import BLOCKED, NONE, STARVED
from conveyor_sim.line.tag import Tag, count, seconds, switch
from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.station import Station

FILLS = frozenset({PackMLState.STARTING, PackMLState.UNSUSPENDING})


class TakingDevice(MachineDevice):
    """Machine that takes the bottle that has waited longest in its region."""

    waiting: tuple[int, ...]
    """Ids of the bottles in the region, in order of arrival."""

    _working = (PackMLState.EXECUTE, PackMLState.COMPLETING)

    def __init__(self, name: str, part: TakingPart, setup: DeviceSetup, own: Sequence[Tag]) -> None:
        fills = () if part.start_fill is None else FILLS
        super().__init__(name, part, setup, own, (PackMLState.COMPLETING, *fills))
        self._region = Region(part.region, setup)
        self._fill, self._zone_name, self._setup = part.start_fill or 0, part.start_zone, setup
        self._zone: ZoneDevice | None = None
        self._run_down_ticks = setup.ticks(part.run_down)
        self.waiting = ()

    def queue(self, now: ScanContext) -> None:
        """Update `waiting`."""
        inside = set(now.state.world.bottles.id[self._region.inside(now)].tolist())
        if inside != set(self.waiting):
            stayed = tuple(bottle for bottle in self.waiting if bottle in inside)
            self.waiting = (*stayed, *sorted(inside.difference(stayed)))

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
            return self._region.inside(now).size
        if self._zone is None:  # zones are built after machines
            self._zone = self._setup.device(ZoneDevice, f"zones/{self._zone_name}")
        return self._zone.count(now)

    def rehearse(self, now: ScanContext) -> None:
        """Search the region."""
        self._region.inside(now)


class SinkDevice(TakingDevice):
    """Downstream machine that takes bottles at a rate. Starved: they are due, and not all of them are in its region."""

    holds: bool | int
    """Bottles that it works on; with one at a time, True or False."""
    holds_bad: bool | int
    """Bad ones among them."""

    def __init__(self, name: str, sink: Sink, setup: DeviceSetup) -> None:
        signals = [
            count(f"{name}/taken", "counter", "Bottles taken.", adds_to="removed"),
            count(f"{name}/taken_bad", "counter", "Bad bottles taken."),
            switch(f"{name}/starved", "status", "A bottle is due, and none is there.", adds_to="state"),
            seconds(f"{name}/starved_time", "counter", "Total time starved."),
        ]
        if not setup.scene.counts_starts:
            signals += [
                count(f"{name}/processed", "counter", "Bottles whose cycle is complete."),
                count(f"{name}/defective", "counter", "Bad bottles among them."),
            ]
        super().__init__(name, sink, setup, signals)
        self._batch = sink.at_once
        self.removed = 0
        self.removed_bad = 0
        self.processed = self.defective = 0
        self.holds = self.holds_bad = False
        self.starved_ticks = 0

    def take(self, now: ScanContext) -> None:
        """Take the bottles that have waited longest, if they are due and all there."""
        if self._busy:
            self.advance(now)
        self.queue(now)
        cause = NONE
        if self.turn(now):
            self._complete()
            if len(self.waiting) < self._batch:
                cause = STARVED
                self.starved_ticks += 1
                self.wait()
            elif self.goes_on():
                taken, self.waiting = self.waiting[: self._batch], self.waiting[self._batch :]
                bad = sum(bottle in now.bad for bottle in taken)
                self.holds, self.holds_bad = (len(taken), bad) if self._batch > 1 else (True, bool(bad))
                for bottle in taken:
                    now.state.remove(now.state.slot_of(bottle))
                self.removed += len(taken)
                self.removed_bad += bad
                self.cycle -= 1.0
        self.conclude(cause, now)

    def _complete(self) -> None:
        """Count the bottles whose cycle is complete."""
        self.processed += self.holds
        self.defective += self.holds_bad
        self.holds = self.holds_bad = False

    @property
    def begun_part(self) -> float:
        """Bottles of the present cycle that are done, a part of them; 0 without a bottle."""
        return (self.cycle if self.holds else self.cycle - 1.0) * self._batch

    def counts(self) -> tuple[int, int, int]:
        """Return processed bottles, and bad ones among them."""
        return (self.removed, self.removed_bad, 0) if self._counts_starts else (self.processed, self.defective, 0)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        taken = self.works, self.removed, self.removed_bad
        starved = self.cause == STARVED, self.waited_time("starved", self.starved_ticks, now)
        completed = () if self._counts_starts else (self.processed, self.defective)
        return *taken, *starved, *completed, *self.status()

    def states(self, now: ScanContext) -> list[float]:
        """Return running, starved, state, category and stop reason."""
        return [self.works, self.cause == STARVED, *self.condition]


class ProcessingDevice(BottleWork, TakingDevice, Scattering):
    """Station of a running line: work on bottles, and their return."""

    def __init__(self, name: str, station: Station, setup: DeviceSetup, own: Sequence[Tag]) -> None:
        """Build the tags. own: signals that show the bottles inside."""
        signals = [
            count(f"{name}/processed", "counter", "Bottles given back."),
            *work_tags(name, station),
            *own,
            switch(f"{name}/starved", "status", "A bottle is due, and none is there.", adds_to="state"),
            switch(f"{name}/blocked", "status", "A bottle is done, and there is no room.", adds_to="state"),
            seconds(f"{name}/starved_time", "counter", "Total time starved."),
            seconds(f"{name}/blocked_time", "counter", "Total time blocked."),
        ]
        super().__init__(name, station, setup, signals)
        self._heading = station.heading
        self.scatter(station, lambda: setup.random(name, JITTER))
        self._radii = setup.model.type_radius.tolist()
        self.work_as(name, station, setup)
        self.starved_ticks = 0
        self.blocked_ticks = 0

    def give_back(self, bottle: int, now: ScanContext) -> int:
        """Return a finished bottle to the line, unless the machine can't go on. Return BLOCKED without room, else NONE.

        Its new type decides whether there is room.
        """
        place, before = self.place(), now.state.held[bottle][0]
        after = self.type_after(before)
        if not has_room(now.state, [place], self._radii[after]):
            self.blocked_ticks += 1
            return BLOCKED
        if self.goes_on():
            self.finish(bottle, now)
            if after != before:
                now.state.convert(bottle, after)
            direction, speed = self._heading
            now.state.give(bottle, *place, *velocity(speed, direction + self.deflection))
            self.draw_scatter()
        return NONE

    def inside(self) -> Sequence[float]:
        """Return the values of the signals that show the bottles inside."""
        raise NotImplementedError

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        return (
            self.works,
            self.processed,
            *self.work_values(),
            *self.inside(),
            self.cause == STARVED,
            self.cause == BLOCKED,
            self.waited_time("starved", self.starved_ticks, now),
            self.waited_time("blocked", self.blocked_ticks, now),
            *self.status(),
        )

    def states(self, now: ScanContext) -> list[float]:
        """Return running, starved, blocked, state, category and stop reason."""
        return [self.works, self.cause == STARVED, self.cause == BLOCKED, *self.condition]


EMPTY = -1


class StationDevice(ProcessingDevice):
    """Station with one bottle at a time.

    Starved: it is empty, and no bottle waits. Blocked: it is done, and there is no room for the bottle.
    """

    def __init__(self, name: str, station: Station, setup: DeviceSetup) -> None:
        super().__init__(name, station, setup, [switch(f"{name}/holds", "status", "A bottle is in the station.")])
        self.holding = EMPTY
        """Id of the bottle in the station."""
        self.begun = 0
        """First tick of the work on it."""
        self.cycle = 0.0

    @property
    def held(self) -> Sequence[int]:
        """Bottle in the station."""
        return () if self.holding == EMPTY else (self.holding,)

    def take(self, now: ScanContext) -> None:
        """Take the bottle that has waited longest, if the station is empty."""
        if self._busy:
            self.advance(now)
        self.queue(now)
        if self.holding == EMPTY and self.works and self.waiting and self.goes_on():
            # The cycle begins now if the station was starved, else when the last bottle left.
            late = self.cause == STARVED
            self.begun, self.cycle = (now.tick, 0.0) if late else (now.tick - 1, self.cycle)
            first, *others = self.waiting
            self.holding = now.state.hold(now.state.slot_of(first))
            self.waiting = tuple(others)

    def feed(self, now: ScanContext) -> None:
        """Work on the bottle, and give it back when it is done, if there is room."""
        cause = NONE
        if self.holding == EMPTY:
            if self.works and now.tick > 0:
                cause = STARVED
                self.starved_ticks += 1
        elif now.tick > self.begun and self.turn(now):
            cause = self.give_back(self.holding, now)
            if cause == BLOCKED:
                self.wait()
            elif self.holding not in now.state.held:
                self.holding = EMPTY
                self.cycle = 0.0 if self.cause == BLOCKED else min(self.cycle - 1.0, 1.0)
        self.conclude(cause, now)

    @property
    def begun_part(self) -> float:
        """Part of the present cycle that is done; 0 without a bottle."""
        return 0.0 if self.holding == EMPTY and self.cause == STARVED else self.cycle

    def inside(self) -> Sequence[float]:
        """Return True if a bottle is in the station."""
        return (self.holding != EMPTY,)

# SPDX-License-Identifier: Apache-2.0
"""Stations that carry several bottles through, such as rinsers and pasteurisers."""

from collections.abc import Sequence

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.machines.machine import ROUNDING
from conveyor_sim.line.machines.station import ProcessingDevice, StationDevice
from conveyor_sim.line.machines.stop_reason import NONE, STARVED
from conveyor_sim.line.tag import count, seconds, switch
from conveyor_sim.scene.parts.station import Station

AT_ONCE = 2.0 * ROUNDING
"""Least way in cycles, so that a bottle stays for a tick at least."""


class CarrierDevice(ProcessingDevice):
    """Station with several bottles, which leave in the order of their arrival.

    It works like a conveyor through the machine: a bottle leaves when the carrier has moved on by `hold` x rate cycles.
    Starved: it is empty, a bottle is due, and none waits. Blocked: its first bottle is done, and there is no room; the
    carrier stops then.
    """

    carried: list[int]
    """Ids of the bottles inside, in the order of their arrival."""
    gaps: list[float]
    """Rest of the way of the first bottle, then the distance of each bottle from the one before it, in cycles."""

    def __init__(self, name: str, station: Station, setup: DeviceSetup) -> None:
        inside = [
            switch(f"{name}/holds", "status", "A bottle is in the station."),
            count(f"{name}/held", "actual", "Bottles in the station.", high=station.capacity),
            count(f"{name}/capacity", "actual", "Most bottles in the station.", high=station.capacity),
            seconds(f"{name}/time_left", "actual", "Time until the next bottle is done, at the rate of the scene."),
        ]
        super().__init__(name, station, setup, inside)
        self._capacity, self._nominal = station.capacity, station.rate
        self._way = max(station.holding_time * station.rate, AT_ONCE)
        self.carried, self.gaps = [], []
        self.last = 0.0
        """Rest of the way of the last bottle, in cycles."""

    @property
    def held(self) -> Sequence[int]:
        """Bottles in the station."""
        return self.carried

    def take(self, now: ScanContext) -> None:
        """Move the carrier. Take the bottle that has waited longest, if one is due and there is room for it."""
        if self._busy:
            self.advance(now)
        self.queue(now)
        before = self.cycle
        due = self.turn(now)
        if self.carried:
            self.gaps[0] -= self.cycle - before
            self.last -= self.cycle - before
        if not due:
            return
        if not self.waiting:
            self.wait()
        elif len(self.carried) < self._capacity and self.goes_on():
            first, *others = self.waiting
            self._load(now.state.hold(now.state.slot_of(first)))
            self.waiting = tuple(others)

    def _load(self, bottle: int) -> None:
        """Put a bottle onto the carrier, at the place that came by at the end of the cycle."""
        late = min(self.cycle - 1.0, 1.0)
        rest = max(self._way - late, AT_ONCE)
        self.gaps.append(rest - self.last if self.carried else rest)
        self.carried.append(bottle)
        self.last, self.cycle = rest, late

    def feed(self, now: ScanContext) -> None:
        """Give the first bottle back when it is done, if there is room."""
        cause = NONE
        if not self.carried:
            if self.works and now.tick > 0 and self.cycle >= 1.0 - ROUNDING:
                cause = STARVED
                self.starved_ticks += 1
        elif self.works and self.gaps[0] <= ROUNDING:
            cause = self.give_back(self.carried[0], now)
            if self.carried[0] not in now.state.held:
                self.carried.pop(0)
                rest = self.gaps.pop(0)
                if self.gaps:
                    self.gaps[0] += rest
        self.conclude(cause, now)

    @property
    def begun_part(self) -> float:
        """Part done of the cycle that ends with the next return; 0 without a bottle."""
        return min(1.0, max(0.0, 1.0 - self.gaps[0])) if self.gaps else 0.0

    def inside(self) -> Sequence[float]:
        """Return whether it holds bottles, their number, the capacity, and the time left (s)."""
        left = max(self.gaps[0], 0.0) / self._nominal if self.gaps else 0.0
        return bool(self.carried), len(self.carried), self._capacity, left


def station_device(name: str, station: Station, setup: DeviceSetup) -> ProcessingDevice:
    """Build a station with one bottle at a time, or one that carries several."""
    return (CarrierDevice if station.carries else StationDevice)(name, station, setup)

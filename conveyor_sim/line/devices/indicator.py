# SPDX-License-Identifier: Apache-2.0
"""Indicators of an exit from its sensors: flow, jam, starved, blocked."""

from collections.abc import Sequence

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.crossing import CounterDevice
from conveyor_sim.line.devices.region import ZoneDevice
from conveyor_sim.line.devices.setpoint import SpeedDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import number, switch
from conveyor_sim.scene.parts.indicator import Indicator

STANDS = 1e-3
"""Speed below which a belt stands still, m/s."""

HOUR = 3600.0
"""Seconds per hour."""


class IndicatorDevice(Device):
    """Indicator of a running line. Times are counted in ticks."""

    recent: list[int]
    """Ticks of the passages within the window."""

    def __init__(self, name: str, indicator: Indicator, setup: DeviceSetup) -> None:
        downstream, backup = indicator.downstream, indicator.backup
        self._can_block = downstream is not None or backup is not None
        most = setup.fastest_flow(indicator.belt) * HOUR
        tags = [
            number(f"{name}/flow", "actual", "Passages within the last window.", "1/h", 0.0, most),
            switch(f"{name}/jam", "status", "Bottles wait, the belt runs, and none has passed for the jam time."),
            switch(f"{name}/starved", "status", "The belt runs, and for the starved time no bottle was waiting."),
        ]
        if self._can_block:
            text = "Bottles wait, the belt is to run, and downstream can't take them."
            tags.append(switch(f"{name}/blocked", "status", text))
        super().__init__(name, tags)
        self._counter = setup.device(CounterDevice, f"counters/{indicator.counter}")
        self._zone = setup.device(ZoneDevice, f"zones/{indicator.zone}")
        self._belt = setup.device(SpeedDevice, f"belts/{indicator.belt}")
        self._downstream = None if downstream is None else setup.device(SpeedDevice, f"belts/{downstream}")
        self._backup = None if backup is None else setup.device(ZoneDevice, f"zones/{backup}")
        starved_time = indicator.jam_time if indicator.starved_time is None else indicator.starved_time
        self._jam_ticks, self._starved_ticks = setup.ticks(indicator.jam_time), setup.ticks(starved_time)
        self._window, self._window_ticks = indicator.window, setup.ticks(indicator.window)
        self.passed = 0
        """Running maximum of (bottles out - bottles back in). A bottle that oscillates at the beam counts once."""
        self.recent = []
        self.stuck = 0
        """Ticks for which no bottle has left although one could."""
        self.empty = 0
        """Ticks since a bottle last waited."""
        self.jam = self.starved = self.blocked = False

    @property
    def alarms(self) -> Sequence[Declared]:
        """Jam alarm."""
        return (error(f"{self.name}/jam", f"{self.name} shows a jam", f"{self.name}/jam"),)

    def end(self, now: ScanContext) -> None:
        """Evaluate this tick."""
        if now.tick == 0:
            return
        out = self._counter.forward - self._counter.backward
        more = max(0, out - self.passed)
        self.passed += more
        oldest = now.tick - self._window_ticks
        self.recent = [tick for tick in self.recent if tick > oldest] + [now.tick] * more
        waits, runs = self._zone.count(now) > 0, _runs(self._belt, now)
        wants = runs or self._belt.wanted(now) != 0.0
        held = (self._downstream is not None and not _runs(self._downstream, now)) or (
            self._backup is not None and self._backup.full(now)
        )
        self.blocked = bool(waits and wants and held)
        self.stuck = 0 if more or not waits or not runs or self.blocked else self.stuck + 1
        # Stopping the belt does not clear a jam.
        jam = bool(self.stuck >= self._jam_ticks or (self.jam and waits and not more))
        if jam is not self.jam:
            self.jam = jam
            now.alarm(f"{self.name}/jam", jam)
        self.empty = self.empty + 1 if runs and not waits else 0
        self.starved = self.empty >= self._starved_ticks

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        flow = len(self.recent) * HOUR / self._window
        return flow, self.jam, self.starved, *((self.blocked,) if self._can_block else ())


def _runs(belt: SpeedDevice, now: ScanContext) -> bool:
    return abs(belt.speed(now)) >= STANDS

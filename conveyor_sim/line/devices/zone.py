"""Zones: number of bottles with their axes in a region, and a switch for a full zone."""

import math
from collections.abc import Sequence

import numpy as np

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.region import Region, most_inside
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, number, switch
from conveyor_sim.scene.parts.zone import Zone

MOST_OFFSET = 1000.0
"""Largest count offset that can be injected."""

DENSEST = 1.0 / (2.0 * math.sqrt(3.0))
"""Bottles of radius 1 per unit area, in a hexagonal pattern."""


class ZoneDevice(Device):
    """Zone of a running line."""

    def __init__(self, name: str, zone: Zone, setup: DeviceSetup) -> None:
        self._region, self._full_at = Region(zone.region), zone.full_at
        x, y = self._region.corners.T
        self._area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
        radius = float(setup.model.type_radius.min())
        densest = max(1.0 / self._area, DENSEST / radius**2)
        tags = [
            count(
                f"{name}/bottles",
                "actual",
                "Bottles whose axis is in the region.",
                high=most_inside(zone.region, radius),
            ),
            number(f"{name}/density", "actual", "Bottles by the area of the region.", "1/m^2", 0.0, densest),
            count(f"{name}/offset", "fault", "Added to the number of bottles.", -MOST_OFFSET, MOST_OFFSET),
        ]
        if zone.full_at is not None:
            tags.append(switch(f"{name}/full", "status", f"Back-up switch: {zone.full_at} bottles or more are there."))
        super().__init__(name, tags)
        self.offset = 0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Inject a count offset."""
        self.offset = int(value)

    def count(self, now: ScanContext) -> int:
        """Return the displayed number of bottles, at least 0."""
        return max(0, self._region.inside(now.state.world.bottles).size + self.offset)

    def full(self, now: ScanContext) -> bool:
        """Return True if the back-up switch is on; False without one."""
        return self._full_at is not None and self.count(now) >= self._full_at

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        count = self.count(now)
        full = () if self._full_at is None else (count >= self._full_at,)
        return count, count / self._area, *full

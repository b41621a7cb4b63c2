# SPDX-License-Identifier: Apache-2.0
"""Regions of the plane: zones count the bottles inside, outfeeds remove them."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.types import F8, I8
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import count, number, switch
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.zone import Zone
from conveyor_sim.scene.types import XY


def most_inside(corners: Sequence[XY] | F8, radius: float) -> int:
    """Return how many bottles of a radius (m) can have their axes in a simple polygon (m).

    Estimated from the area within one radius of the polygon.
    """
    outline = np.asarray(corners, dtype=np.float64)
    after = np.roll(outline, -1, axis=0)
    area = 0.5 * abs(float(np.sum(outline[:, 0] * after[:, 1] - outline[:, 1] * after[:, 0])))
    length = float(np.hypot(*(after - outline).T).sum())
    bottle = math.pi * radius * radius
    return math.floor((area + length * radius + bottle) / bottle + 1e-9)


class Region:
    """Simple polygon."""

    def __init__(self, corners: Sequence[XY], setup: DeviceSetup) -> None:
        """Store the corners, in order, m."""
        self.corners: NDArray[np.float64] = np.array(corners, dtype=np.float64)
        self._search = setup.regions
        self._number = self._search.add(self.corners)

    def inside(self, now: ScanContext) -> I8:
        """Return the slots of bottles whose axes are inside, (n,). Valid until the next call."""
        return self._search.inside(self._number, now.state.world.bottles, now.state.moves, now.state.removals)


MOST_OFFSET = 1000.0
"""Largest count offset that can be injected."""

DENSEST = 1.0 / (2.0 * math.sqrt(3.0))
"""Bottles of radius 1 per unit area, in a hexagonal pattern."""


class ZoneDevice(Device):
    """Number of bottles with their axes in a region, and a switch for a full zone."""

    def __init__(self, name: str, zone: Zone, setup: DeviceSetup) -> None:
        self._region, self._full_at = Region(zone.region, setup), zone.full_at
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
            tags.append(switch(f"{name}/full", "status", f"Back-up switch: {zone.full_at} bottles or more inside."))
        super().__init__(name, tags)
        self.offset = 0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Inject a count offset."""
        self.offset = int(value)

    def count(self, now: ScanContext) -> int:
        """Return the displayed number of bottles, at least 0."""
        return max(0, self._region.inside(now).size + self.offset)

    def full(self, now: ScanContext) -> bool:
        """Return True if the back-up switch is on; False without one."""
        return self._full_at is not None and self.count(now) >= self._full_at

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the values in the order of the signals."""
        count = self.count(now)
        full = () if self._full_at is None else (count >= self._full_at,)
        return count, count / self._area, *full


class OutfeedDevice(Device):
    """Region that removes bottles whose axes are inside."""

    def __init__(self, name: str, outfeed: Outfeed, setup: DeviceSetup) -> None:
        super().__init__(
            name, [count(f"{name}/removed", "counter", "Bottles removed.", adds_to="removed").of("removed")]
        )
        self._region = Region(outfeed.region, setup)
        self.removed = 0

    def take(self, now: ScanContext) -> None:
        """Remove the bottles that are inside now."""
        for slot in self._region.inside(now).tolist():
            now.state.remove(slot)
            self.removed += 1

    def counts(self) -> tuple[int, int, int]:
        """Return removed bottles. None of them are inspected."""
        return self.removed, 0, 0

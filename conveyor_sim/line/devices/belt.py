# SPDX-License-Identifier: Apache-2.0
"""Belts: actual speed, bottles on the belt. A belt without a drive has a speed setpoint, which it follows at once."""

from collections.abc import Sequence

from conveyor_sim.line.commands.refusal import moved_text
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.axis import AxisDevice
from conveyor_sim.line.devices.drive import DriveDevice, NamedDriveDevice
from conveyor_sim.line.devices.region import most_inside
from conveyor_sim.line.devices.setpoint import SetpointDevice, SpeedDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, count, number
from conveyor_sim.scene.belts import Belt
from conveyor_sim.scene.drives import Drive
from conveyor_sim.scene.gearing import travel_per_radian
from conveyor_sim.scene.geometry import shapes_of_belt


class DrivenBelt(SpeedDevice):
    """Belt that a named drive or an axis moves. It takes no commands."""

    def __init__(
        self, name: str, drive: NamedDriveDevice | AxisDevice, ratio: float, bottles: Tag, setup: DeviceSetup
    ) -> None:
        """Build the tags. ratio: speed of the belt over that of the drive (1) or of the axis (m)."""
        text = moved_text(drive.name, ratio)
        low, high, start = (ratio * speed for speed in drive.speed_range)
        super().__init__(name, setup, [number(f"{name}/speed", "actual", text, "m/s", low, high, start), bottles])
        self._drive, self._ratio = drive, ratio

    def wanted(self, now: ScanContext) -> float:
        """Return the speed that the drive is commanded to give it, m/s."""
        return self._ratio * self._drive.wanted(now)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the speed, m/s, and the number of bottles on the belt."""
        return now.speeds[self._index], now.carried(self._index)


def belt_device(name: str, belt: Belt, setup: DeviceSetup) -> Device:
    """Build a belt: with a separate drive, moved by an axis or a named drive, or without a drive."""
    short_name = name.rpartition("/")[2]
    radius = float(setup.model.type_radius.min())
    most = sum(most_inside(shape.outline(), radius) for shape in shapes_of_belt(short_name, belt))
    bottles = count(f"{name}/bottles", "actual", "Bottles whose axis is on the belt.", high=most)
    if belt.axis is not None:
        axis = setup.device(AxisDevice, f"axes/{belt.axis}")
        return DrivenBelt(name, axis, travel_per_radian(belt), bottles, setup)
    if isinstance(belt.drive, str):
        drive = setup.device(NamedDriveDevice, f"drives/{belt.drive}")
        return DrivenBelt(name, drive, belt.ratio, bottles, setup)
    if isinstance(belt.drive, Drive):
        return DriveDevice(name, belt, belt.drive, setup, bottles)
    return SetpointDevice(name, belt, setup, bottles)

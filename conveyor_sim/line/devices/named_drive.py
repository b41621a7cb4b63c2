"""Named drives: one drive moves several belts, each at its ratio."""

import numpy as np

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.drive import DriveDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.scene.driven import driven_by
from conveyor_sim.scene.drives import NamedDrive


class NamedDriveDevice(DriveDevice):
    """Drive that belts refer to by name. Its speed is that of its belts at ratio 1."""

    def __init__(self, name: str, drive: NamedDrive, setup: DeviceSetup) -> None:
        """Build the tags."""
        super().__init__(name, drive, drive, setup)
        belts = driven_by(setup.scene, name.rpartition("/")[2])
        self._belts = np.array([setup.speed_index(f"belts/{belt}") for belt in belts], dtype=np.int64)
        self._ratios = np.array([setup.scene.belts[belt].ratio for belt in belts])

    @property
    def speed_range(self) -> tuple[float, float, float]:
        """Least and greatest speed, and that at the start, m/s."""
        speed = self.signals[0]
        return speed.low, speed.high, speed.initial

    def take_setpoint(self, value: float, now: ScanContext) -> None:
        """Set the setpoint of the drive and those of its belts, m/s."""
        super().take_setpoint(value, now)
        now.setpoints[self._belts] = self._ratios * value

    def begin(self, now: ScanContext) -> None:
        """Move the drive and its belts for one tick."""
        before = now.speeds[self._index]
        super().begin(now)
        if (speed := now.speeds[self._index]) != before:
            now.speeds[self._belts] = self._ratios * speed

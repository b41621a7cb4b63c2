# SPDX-License-Identifier: Apache-2.0
"""`PowerSupply`: power of drives and machines, which emergency stops take."""

import math
from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.scene.parts.panel import Load


class PowerSupply(Device):
    """Power supply of a line whose emergency stops take power. It has no tags.

    Power that returns starts no drive: each one is locked until its next start command.
    """

    latched: list[str]
    """Names of the emergency stops that take power now."""
    locked: list[str]
    """Names of the drives that await a start command."""

    def __init__(self) -> None:
        """Start with power, and without consumers."""
        super().__init__("power")
        self._cuts: dict[str, Sequence[Load]] = {}
        self._cells: dict[str, str | None] = {}
        self._fed: dict[Load, list[Device]] = {"drives": [], "machines": []}
        self._deceleration = math.inf
        self.latched = []
        self.locked = []

    def add_stop(self, name: str, cuts: Sequence[Load], deceleration: float | None, cell: str | None) -> None:
        """Add an emergency stop by its name. deceleration: of belts without power, m/s^2. cell: as in the scene."""
        self._cuts[name] = cuts
        self._cells[name] = cell
        if deceleration is not None:
            self._deceleration = deceleration

    def feeds(self, load: Load, device: Device) -> bool:
        """Connect a consumer, and return True if an emergency stop can take its power."""
        self._fed[load].append(device)
        return any(self._takes(stop, load, device.name) for stop in self._cuts)

    def taken_by(self, load: Load, device: str) -> list[str]:
        """Return the emergency stops that take the power of a consumer now."""
        return [stop for stop in self.latched if self._takes(stop, load, device)]

    def holds(self, drive: str) -> bool:
        """Return True while a drive has no power, or awaits a start command."""
        return drive in self.locked

    def start(self, drive: str) -> None:
        """Unlock a drive at a start command, if it has power."""
        if drive in self.locked and not self.taken_by("drives", drive):
            self.locked.remove(drive)

    def coast(self, speed: float, interval: float) -> float:
        """Return the speed (m/s) of a belt without power after an interval (s)."""
        return math.copysign(max(0.0, abs(speed) - self._deceleration * interval), speed)

    def cut(self, name: str, now: ScanContext) -> None:
        """Take power, because an emergency stop has latched."""
        self.latched.append(name)
        for drive in self._fed["drives"]:
            if self._takes(name, "drives", drive.name):
                drive.wake()
                if drive.name not in self.locked:
                    self.locked.append(drive.name)
        for machine in self._fed["machines"]:
            if self._takes(name, "machines", machine.name):
                machine.cut_power(now)

    def restore(self, name: str) -> None:
        """Give power back, because an emergency stop was reset."""
        self.latched.remove(name)

    def _takes(self, stop: str, load: Load, device: str) -> bool:
        """Return True if an emergency stop takes the power of a consumer, such as machines/block_filler."""
        cell = self._cells[stop]
        return load in self._cuts[stop] and (not cell or device.partition("/")[2].startswith(f"{cell}_"))

    def restored(self, tick: int) -> None:
        """Check the restored attributes. Raise ValueError if they do not fit the line."""
        drives = {drive.name for drive in self._fed["drives"]}
        if not (set(self.latched) <= self._cuts.keys() and set(self.locked) <= drives):
            raise ValueError("line.devices.power has an unknown emergency stop or drive")

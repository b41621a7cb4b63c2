# SPDX-License-Identifier: Apache-2.0
"""Devices with a speed, and those among them with a speed setpoint and a watchdog."""

from collections.abc import Sequence
from dataclasses import dataclass

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.commands.authority import AUTOMATIC
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, number
from conveyor_sim.scene.drives import SpeedSetpoint


@dataclass
class Watchdog:
    """Watchdog of a belt or named drive: stops it if no speed command is accepted for a time-out of simulated time."""

    timeout_ticks: int
    last: int = 0
    """Tick of the last accepted speed command."""
    tripped: bool = False
    rests: bool = False
    """True while the device is not in automatic mode."""

    def command(self, tick: int) -> None:
        """Restart the time-out, because a command was accepted."""
        self.last = tick
        self.tripped = False

    def rest(self, tick: int, rests: bool) -> None:
        """Suspend the watchdog outside automatic mode, and restart its time-out at each mode change."""
        self.rests = rests
        self.command(tick)

    def trips(self, tick: int) -> bool:
        """Return True once, at the first tick after the time-out: the belt must stop."""
        if self.rests or self.tripped or tick - self.last < self.timeout_ticks:
            return False
        self.tripped = True
        return True


class SpeedDevice(Device):
    """Belt or named drive."""

    def __init__(self, name: str, setup: DeviceSetup, tags: Sequence[Tag]) -> None:
        """Store the place of its speed."""
        super().__init__(name, tags)
        self._index = setup.speed_index(name)

    def speed(self, now: ScanContext) -> float:
        """Return the present speed, m/s."""
        return float(now.speeds[self._index])

    def wanted(self, now: ScanContext) -> float:
        """Return the commanded speed, m/s."""
        return float(now.setpoints[self._index])


class SetpointDevice(SpeedDevice):
    """Belt or named drive with a speed setpoint. The speed follows at once."""

    _starts_by_speed = True
    """True if a setpoint that changes from 0 to another value is a start command."""

    def __init__(
        self,
        name: str,
        part: SpeedSetpoint,
        setup: DeviceSetup,
        bottles: Tag | None = None,
        more: Sequence[Tag] = (),
        backward: bool = False,
    ) -> None:
        """Build the tags.

        bottles: signal of the number of bottles on a belt. more: tags that a drive adds. backward: True if the drive
        can reverse the setpoint.
        """
        low, high = part.speed_limits
        reach = (low, high, -low, -high) if backward else (low, high)
        least, greatest = min(0.0, *reach), max(0.0, *reach)
        surface = "the surface" if bottles is not None else "its belts at ratio 1"
        self._speed_command = f"{name}/cmd_speed"
        super().__init__(
            name,
            setup,
            [
                number(f"{name}/speed", "actual", f"Speed of {surface}.", "m/s", least, greatest, part.speed),
                *(() if bottles is None else (bottles,)),
                number(
                    self._speed_command, "setpoint", "Speed to run at, positive forward.", "m/s", low, high, part.speed
                ),
                *more,
            ],
        )
        self._carries = bottles is not None
        self._power = setup.power("drives", self)
        timeout = part.watchdog
        self.watchdog = None if timeout is None else Watchdog(max(1, setup.ticks(timeout)))

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarm of the watchdog."""
        if self.watchdog is None:
            return ()
        text = f"{self.name} stopped: its watchdog received no command"
        return (error(f"{self.name}/watchdog", text, f"{self.name}/speed"),)

    @property
    def is_locked(self) -> bool:
        """True without power, and until the start command after that."""
        return self._power is not None and self._power.holds(self.name)

    def start(self) -> None:
        """Take a start command, which unlocks a drive whose power was taken."""
        if self._power is not None:
            self._power.start(self.name)

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply a setpoint, m/s."""
        if self._starts_by_speed and value != 0.0 and now.setpoints[self._index] == 0.0:
            self.start()
        self.take_setpoint(value, now)
        if self.watchdog is not None:
            if self.watchdog.tripped:
                now.alarm(f"{self.name}/watchdog", False)
            self.watchdog.command(now.tick)

    def take_setpoint(self, value: float, now: ScanContext) -> None:
        """Set the setpoint, m/s."""
        if now.setpoints.item(self._index) != value:
            self.wake()
            now.setpoints[self._index] = value

    def rests(self, now: ScanContext) -> bool:
        """Return True if it has the speed of the setpoint."""
        return now.speeds.item(self._index) == now.setpoints.item(self._index) and not self.is_locked

    def take_mode(self, mode: int, now: ScanContext) -> None:
        """Suspend the watchdog outside automatic mode."""
        if self.watchdog is not None:
            self.watchdog.rest(now.tick, mode != AUTOMATIC)

    def watch(self, now: ScanContext) -> str:
        """Return the name of the setpoint if the watchdog stops the device at this tick, "" otherwise."""
        if self.watchdog is None or not self.watchdog.trips(now.tick):
            return ""
        self.take_setpoint(0.0, now)
        now.alarm(f"{self.name}/watchdog", True)
        return self._speed_command

    def begin(self, now: ScanContext) -> None:
        """Set the speed to the setpoint, or coast without power."""
        if self._power is not None and self._power.holds(self.name):
            now.speeds[self._index] = self._power.coast(float(now.speeds[self._index]), now.length)
        else:
            now.speeds[self._index] = now.setpoints[self._index]

    def wanted(self, now: ScanContext) -> float:
        """Return the commanded speed, m/s; 0 without power, and until the start command after that."""
        return 0.0 if self.is_locked else super().wanted(now)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the speed, m/s, and the number of bottles on a belt."""
        speed = now.speeds.item(self._index)
        return (speed, now.carried(self._index)) if self._carries else (speed,)

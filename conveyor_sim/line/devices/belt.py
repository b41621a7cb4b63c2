"""Belts: speed setpoint, actual speed, bottles on the belt, watchdog. Without a drive, the speed follows at once."""

from collections.abc import Sequence
from dataclasses import dataclass

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.commands.authority import AUTOMATIC
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.region import most_inside
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.process_image import speed_command
from conveyor_sim.line.tag import Tag, count, number
from conveyor_sim.scene.belts import Belt
from conveyor_sim.scene.geometry import shapes_of_belt


@dataclass
class Watchdog:
    """Watchdog that stops a belt if no command was accepted within its time-out (simulated time)."""

    timeout_ticks: int
    last: int = 0
    """Tick of the last accepted command."""
    tripped: bool = False
    rests: bool = False
    """True while no controller is in control of the belt."""

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


class BeltDevice(Device):
    """Belt of a running line."""

    def __init__(
        self,
        name: str,
        belt: Belt,
        setup: DeviceSetup,
        more: Sequence[Tag] = (),
        backward: bool = False,
    ) -> None:
        """Build the tags.

        more: tags that a drive adds. backward: True if the drive can reverse the setpoint.
        """
        short_name = name.rpartition("/")[2]
        setpoint, (low, high) = speed_command(short_name), belt.speed_limits
        reach = (low, high, -low, -high) if backward else (low, high)
        radius = float(setup.model.type_radius.min())
        most = sum(most_inside(shape.outline(), radius) for shape in shapes_of_belt(short_name, belt))
        super().__init__(
            name,
            [
                number(
                    f"{name}/speed",
                    "actual",
                    "Speed of the surface.",
                    "m/s",
                    min(0.0, *reach),
                    max(0.0, *reach),
                    belt.speed,
                ),
                count(f"{name}/bottles", "actual", "Bottles whose axis is on the belt.", high=most),
                number(setpoint, "setpoint", "Speed to run at, positive forward.", "m/s", low, high, belt.speed),
                *more,
            ],
        )
        self._index = setup.index("belts", short_name)
        self._speed_command = speed_command(short_name)
        timeout = belt.watchdog
        self.watchdog = None if timeout is None else Watchdog(max(1, setup.ticks(timeout)))

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarm of the watchdog."""
        if self.watchdog is None:
            return ()
        text = f"{self.name} stopped: its watchdog received no command"
        return (error(f"{self.name}/watchdog", text, f"{self.name}/speed"),)

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply a setpoint, m/s."""
        now.setpoints[self._index] = value
        if self.watchdog is not None:
            if self.watchdog.tripped:
                now.alarm(f"{self.name}/watchdog", False)
            self.watchdog.command(now.tick)

    def take_mode(self, mode: int, now: ScanContext) -> None:
        """Let the watchdog rest outside automatic mode."""
        if self.watchdog is not None:
            self.watchdog.rest(now.tick, mode != AUTOMATIC)

    def watch(self, now: ScanContext) -> str:
        """Return the name of the setpoint if the watchdog stops the belt at this tick, "" otherwise."""
        if self.watchdog is None or not self.watchdog.trips(now.tick):
            return ""
        now.setpoints[self._index] = 0.0
        now.alarm(f"{self.name}/watchdog", True)
        return self._speed_command

    def begin(self, now: ScanContext) -> None:
        """Set the speed to the setpoint."""
        now.speeds[self._index] = now.setpoints[self._index]

    def speed(self, now: ScanContext) -> float:
        """Return the present speed, m/s."""
        return float(now.speeds[self._index])

    def wanted(self, now: ScanContext) -> float:
        """Return the commanded speed, m/s."""
        return float(now.setpoints[self._index])

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the speed, m/s, and the number of bottles on the belt."""
        return now.speeds[self._index], now.carried(self._index)

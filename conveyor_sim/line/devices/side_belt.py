# SPDX-License-Identifier: Apache-2.0
"""Side belts: timing belts and side grippers, whose surfaces drive bottles from the side."""

from collections.abc import Sequence

from conveyor_sim.line.commands.refusal import moved_text
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.axis import AxisDevice
from conveyor_sim.line.devices.drive import AT_SPEED, Ramp
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import number, switch
from conveyor_sim.scene.moving import bodies_of
from conveyor_sim.scene.parts.side_belt import SideBelt

_SLIP = "Share of the drive's speed by which the surface is slower."


class SideBeltDevice(Device):
    """Side belt with its drive. It runs at the start, at the speed of the scene."""

    def __init__(self, name: str, part: SideBelt, setup: DeviceSetup) -> None:
        """Build the tags."""
        low, high = part.speed_limits
        least, greatest = min(0.0, low), max(0.0, high)
        super().__init__(
            name,
            (
                number(f"{name}/speed", "actual", "Speed of the surface.", "m/s", least, greatest, part.speed),
                switch(f"{name}/at_speed", "status", "True while the speed equals the commanded speed.", 1.0),
                number(
                    f"{name}/cmd_speed", "setpoint", "Speed to run at, positive forward.", "m/s", low, high, part.speed
                ),
                switch(f"{name}/run", "command", "Runs while on.", 1.0),
                switch(f"{name}/jammed", "fault", "Stands still at once."),
                number(f"{name}/slip", "fault", _SLIP, "1", 0.0, 1.0),
            ),
        )
        self._body = _body_of(name, setup)
        self._acceleration = part.acceleration
        self._power = setup.power("drives", self)
        self.ramp = Ramp(part.speed)
        self.setpoint = part.speed
        self.run = True
        self.jammed = False
        self.slip = 0.0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the setpoint (m/s), run, or a fault."""
        what = name.rpartition("/")[2]
        if what == "cmd_speed":
            self.setpoint = value
        elif what == "slip":
            self.slip = value
        elif what == "jammed":
            self.jammed = value != 0.0
        else:
            if value != 0.0 and not self.run and self._power is not None:
                self._power.start(self.name)
            self.run = value != 0.0

    def begin(self, now: ScanContext) -> None:
        """Ramp for one tick, or coast without power, and set the speed of the surface."""
        ramp = self.ramp
        if self.jammed:
            ramp.value = ramp.acceleration = 0.0
        elif self._is_locked and self._power is not None:
            ramp.value, ramp.acceleration = self._power.coast(ramp.value, now.length), 0.0
        else:
            ramp.approach(self._wanted, self._acceleration, None, now.length)
        _set_speed(self._body, self._speed, now)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return speed and at_speed."""
        return self._speed, float(abs(self.ramp.value - self._wanted) <= AT_SPEED)

    @property
    def _speed(self) -> float:
        return self.ramp.value * (1.0 - self.slip)

    @property
    def _wanted(self) -> float:
        return self.setpoint if self.run and not self._is_locked else 0.0

    @property
    def _is_locked(self) -> bool:
        return self._power is not None and self._power.holds(self.name)


class GearedSideBelt(Device):
    """Side belt that an axis moves. It has no drive: its jam blocks the axis."""

    def __init__(self, name: str, part: SideBelt, setup: DeviceSetup) -> None:
        """Build the tags."""
        self._axis, self._travel = setup.device(AxisDevice, f"axes/{part.axis}"), part.travel_per_radian
        low, high, start = (self._travel * speed for speed in self._axis.speed_range)
        text = moved_text(self._axis.name, self._travel)
        super().__init__(
            name,
            (
                number(f"{name}/speed", "actual", text, "m/s", low, high, start),
                switch(f"{name}/jammed", "fault", "It is blocked, and with it its axis, against any torque."),
                number(f"{name}/slip", "fault", _SLIP, "1", 0.0, 1.0),
            ),
        )
        self._axis.add_machine(self)
        self._body = _body_of(name, setup)
        self.speed = start
        """Speed of the surface in the last tick, m/s."""
        self.jammed = False
        self.slip = 0.0

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the fault `jammed` or `slip`."""
        if name == f"{self.name}/jammed":
            self.jammed = value != 0.0
        else:
            self.slip = value

    def begin(self, now: ScanContext) -> None:
        """Set the speed of the surface to the mean of the tick, as for belts on an axis."""
        self.speed = self._travel * self._axis.mean_speed * (1.0 - self.slip)
        _set_speed(self._body, self.speed, now)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the speed of the surface, m/s."""
        return (self.speed,)


def side_belt_device(name: str, part: SideBelt, setup: DeviceSetup) -> Device:
    """Build a side belt with a drive, or one that an axis moves."""
    return (SideBeltDevice if part.axis is None else GearedSideBelt)(name, part, setup)


def _body_of(name: str, setup: DeviceSetup) -> int:
    """Return the number of the body of a side belt."""
    return [body.name for body in bodies_of(setup.scene)].index(name)


def _set_speed(body: int, speed: float, now: ScanContext) -> None:
    """Set the speed (m/s) of the surface of a body."""
    moving = now.state.world.moving
    assert moving is not None and moving.surface_speed is not None
    moving.surface_speed[body] = speed

# SPDX-License-Identifier: Apache-2.0
"""Side belts: timing belts and side grippers, whose surfaces drive bottles from the side."""

from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.drive import AT_SPEED, Ramp
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import number, switch
from conveyor_sim.scene.moving import bodies_of
from conveyor_sim.scene.parts.side_belt import SideBelt


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
                number(
                    f"{name}/slip", "fault", "Share of the drive's speed by which the surface is slower.", "1", 0.0, 1.0
                ),
            ),
        )
        self._body = [body.name for body in bodies_of(setup.scene)].index(name)
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
        moving = now.state.world.moving
        assert moving is not None and moving.surface_speed is not None
        moving.surface_speed[self._body] = self._speed

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

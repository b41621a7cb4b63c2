# SPDX-License-Identifier: Apache-2.0
"""Star wheels and infeed screws: machines on the shaft of an axis, with faults of the shaft."""

import math
from collections.abc import Sequence

from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.axis import AxisDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import number, switch
from conveyor_sim.scene.moving import bodies_of
from conveyor_sim.scene.parts.screw import Screw
from conveyor_sim.scene.parts.star import Star

TURN = 2.0 * math.pi

SLIP_SPEED = 0.01
"""Speed at which a machine slips on its shaft, at the axes of bottles, m/s: 0.1 mm per tick of 10 ms."""


class GearedMachine(Device):
    """Machine that an axis turns. It has no drive: its faults act on its shaft, and through it on the axis."""

    def __init__(self, name: str, part: Star | Screw, setup: DeviceSetup, word: str, travel: float) -> None:
        """Build the tags.

        word: name of the machine in descriptions. travel: of a bottle per radian of the axis, m.
        """
        bodies = bodies_of(setup.scene)
        self._numbers = [number for number, body in enumerate(bodies) if body.name == name]
        self._lags = [bodies[number].lag for number in self._numbers]
        self._axis = setup.device(AxisDevice, f"axes/{part.axis}")
        self._axis.add_machine(self)
        self._step = SLIP_SPEED * setup.scene.tick / travel
        super().__init__(
            name,
            (
                number(f"{name}/angle", "actual", f"Angle of the {word} from its phase.", "rad", 0.0, TURN),
                switch(f"{name}/jammed", "fault", f"The {word} is blocked, and with it its axis, against any torque."),
                number(
                    f"{name}/slip",
                    "fault",
                    f"Angle by which the {word} slips on its shaft, positive backward.",
                    "rad",
                    -math.pi,
                    math.pi,
                ),
            ),
        )
        self.jammed = False
        self.slip = 0.0
        """Angle up to which it slips, rad."""
        self.slipped = 0.0
        """Angle by which it has slipped, rad."""

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply the fault `jammed` or `slip`."""
        if name == f"{self.name}/jammed":
            self.jammed = value != 0.0
        else:
            self.slip = value

    def begin(self, now: ScanContext) -> None:
        """Slip for one tick."""
        if self.slipped != self.slip:
            left = self.slip - self.slipped
            self.slipped = self.slip if abs(left) <= self._step else self.slipped + math.copysign(self._step, left)
            moving = now.state.world.moving
            assert moving is not None
            for place, lag in zip(self._numbers, self._lags, strict=True):
                moving.lag[place] = lag + self.slipped

    @property
    def angle(self) -> float:
        """Angle from its phase, rad, from 0 to a turn."""
        return self.coordinate % TURN

    @property
    def coordinate(self) -> float:
        """Position of its axis minus its phase and its slip, rad."""
        return self._axis.actual_position - self._lags[0] - self.slipped

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the angle."""
        return (self.angle,)


class ScrewDevice(GearedMachine):
    """Infeed screw."""

    def __init__(self, name: str, part: Screw, setup: DeviceSetup) -> None:
        """Build the tags."""
        super().__init__(name, part, setup, "screw", part.last_pitch / TURN)


class StarDevice(GearedMachine):
    """Star wheel."""

    def __init__(self, name: str, part: Star, setup: DeviceSetup) -> None:
        """Build the tags."""
        super().__init__(name, part, setup, "wheel", part.pitch_radius)
        self._cam = bodies_of(setup.scene)[self._numbers[0]].cam

    @property
    def angle(self) -> float:
        """Angle from its phase, rad, from 0 to a turn, with the cam of its axis."""
        if self._cam is None:
            return super().angle
        return self._cam.at(self.coordinate % self._cam.end)[0] % TURN

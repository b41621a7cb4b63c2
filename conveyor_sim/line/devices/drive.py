# SPDX-License-Identifier: Apache-2.0
"""Drives: ramps, running, reversing, trips and reset, and travel of an encoder; drives that move several belts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.edge import RisingEdge
from conveyor_sim.line.devices.setpoint import SetpointDevice
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import MOST_COUNT, Tag, count, switch
from conveyor_sim.scene.driven import driven_by
from conveyor_sim.scene.drives import Drive, NamedDrive, SpeedSetpoint

AT_SPEED = 1e-9
"""Tolerance between setpoint and speed, m/s."""


@dataclass
class Ramp:
    """Speed that follows a setpoint within limits of acceleration and jerk.

    It does not overshoot from rest. If the setpoint changes on the way, the jerk limit may cause an overshoot.
    """

    value: float
    """Speed, m/s."""
    acceleration: float = 0.0
    """Acceleration in the last interval, m/s^2."""

    def approach(self, setpoint: float, limit: float | None, jerk: float | None, interval: float) -> float:
        """Return the speed (m/s) after an interval (s).

        limit: m/s^2. jerk: m/s^3. None for no limit; there is no jerk limit without an acceleration limit.
        """
        left = setpoint - self.value
        if left == 0.0 and self.acceleration == 0.0:
            return self.value
        if limit is None:
            self.value = setpoint
            return self.value
        wanted = min(limit, abs(left) / interval)
        if jerk is not None:
            # The sum of a, a - j dt, ... down to 0, each for dt, is a^2 / (2 j) + a dt / 2.
            wanted = min(wanted, jerk * (math.sqrt(0.25 * interval**2 + 2.0 * abs(left) / jerk) - 0.5 * interval))
        wanted = math.copysign(wanted, left)
        if jerk is not None:
            most = jerk * interval
            wanted = min(max(wanted, self.acceleration - most), self.acceleration + most)
        change = wanted * interval
        arrived = abs(left - change) <= 1e-12 * max(1.0, abs(setpoint))
        self.acceleration = wanted
        self.value = setpoint if arrived else self.value + change
        if arrived and (jerk is None or abs(wanted) <= jerk * interval):
            self.acceleration = 0.0
        return self.value


class DriveDevice(SetpointDevice):
    """Belt with a separate drive, or named drive. It runs at the start, at the speed of the scene.

    A trip ramps it down; it runs again after the fault has ended and `reset` has had a rising edge. Without power it
    coasts, and it runs again after power has returned and `run` has had a rising edge.
    """

    _starts_by_speed = False

    travel: float
    """Travel forward minus backward, m. Only drives with an encoder have it."""

    def __init__(
        self,
        name: str,
        part: SpeedSetpoint,
        drive: Drive | NamedDrive,
        setup: DeviceSetup,
        bottles: Tag | None = None,
    ) -> None:
        """Build the tags. bottles: signal of the number of bottles on a belt."""
        tags = [
            switch(f"{name}/running", "status", "Commanded to run, and not tripped.", 1.0, "state"),
            switch(
                f"{name}/at_speed",
                "status",
                "True while the speed equals the commanded speed, including standstill.",
                1.0,
            ),
            switch(f"{name}/fault", "status", "It has tripped.", adds_to="state"),
            switch(f"{name}/run", "command", "Runs while on.", 1.0),
            switch(f"{name}/reverse", "command", "Runs backward while on."),
            switch(f"{name}/reset", "command", "Its rising edge resets a trip whose cause is gone."),
            switch(f"{name}/trip", "fault", "The drive trips and stops along its ramp."),
        ]
        if drive.pulses_per_metre is not None:
            text = "Pulses of the encoder, counted down in reverse."
            tags.append(count(f"{name}/pulses", "counter", text, low=-MOST_COUNT))
        super().__init__(name, part, setup, bottles, tags, backward=True)
        self._drive = drive
        self._tripped = f"{name}/tripped"
        self.ramp = Ramp(part.speed)
        self.run = True
        self.reverse = False
        self.reset = RisingEdge()
        self.trip = False
        self.tripped = False
        if drive.pulses_per_metre is not None:
            self.travel = 0.0

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarm of a trip, and that of the watchdog."""
        what = f"the drive of {self.name}" if self._carries else self.name
        return (error(self._tripped, f"{what} has tripped", f"{self.name}/fault"), *super().alarms)

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Apply a setpoint (m/s), run, reverse, reset, or the fault `trip`."""
        if name == self._speed_command:
            super().command(name, value, now)
            return
        what = name.removeprefix(f"{self.name}/")
        if self._is_on(what) == (value != 0.0):
            return
        self.wake()
        if what == "run":
            if value != 0.0:
                self.start()
            self.run = value != 0.0
        elif what == "reverse":
            self.reverse = value != 0.0
        elif what == "reset":
            if self.reset.rises(value) and not self.trip:
                self.tripped = False
                now.alarm(self._tripped, False)
        else:
            self.trip = value != 0.0
            self.tripped = self.tripped or self.trip
            now.alarm(self._tripped, self.tripped)

    @property
    def takes_repeats(self) -> bool:
        """True if a watchdog waits for commands."""
        return self.watchdog is not None

    def _is_on(self, what: str) -> bool | None:
        """Return the state of a command's switch; None for the fault `trip`."""
        if what == "run":
            return self.run
        if what == "reverse":
            return self.reverse
        return self.reset.on if what == "reset" else None

    def rests(self, now: ScanContext) -> bool:
        """Return True at constant speed, without an encoder that counts."""
        ramp = self.ramp
        if ramp.value != 0.0 and self._drive.pulses_per_metre is not None:
            return False
        return ramp.acceleration == 0.0 and ramp.value == self.wanted(now)

    def begin(self, now: ScanContext) -> None:
        """Ramp for one tick."""
        drive, ramp, wanted = self._drive, self.ramp, self.wanted(now)
        if self._power is not None and self._power.holds(self.name):
            ramp.value, ramp.acceleration = self._power.coast(ramp.value, now.length), 0.0
            now.speeds[self._index] = ramp.value
            return
        if ramp.value != wanted or ramp.acceleration != 0.0:
            now.speeds[self._index] = ramp.approach(wanted, drive.acceleration, drive.jerk, now.length)

    def end(self, now: ScanContext) -> None:
        """Add the travel of this tick."""
        if now.tick > 0 and self._drive.pulses_per_metre is not None:
            self.travel += self.ramp.value * now.length

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the speed and the bottles of a belt, then running, at_speed, fault, and pulses."""
        runs = self._runs
        at_speed = abs(self.ramp.value - self._commanded(runs, now)) <= AT_SPEED
        values = [*super().values(now), runs, at_speed, self.tripped]
        if self._drive.pulses_per_metre is not None:
            values.append(math.floor(self.travel * self._drive.pulses_per_metre + 1e-9))
        return values

    def states(self, now: ScanContext) -> list[float]:
        """Return running and fault."""
        return [self._runs, self.tripped]

    @property
    def _runs(self) -> bool:
        return self.run and not self.tripped and not self.is_locked

    def wanted(self, now: ScanContext) -> float:
        """Return the commanded speed, m/s; 0 while stopped, tripped or without power."""
        return self._commanded(self._runs, now)

    def _commanded(self, runs: bool, now: ScanContext) -> float:
        if not runs:
            return 0.0
        setpoint = now.setpoints.item(self._index)
        return -setpoint if self.reverse else setpoint


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

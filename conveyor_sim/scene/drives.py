# SPDX-License-Identifier: Apache-2.0
"""Drives in a scene file: of one belt, or with a name and several belts."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.device_part import DevicePart, Others
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Limits, Number, Positive, quantity
from conveyor_sim.scene.words import shown

_JERK = "Largest change of acceleration per second: ramps become S-curves. Left out: there is no limit."
_PULSES = "Pulses of the encoder per metre of travel, counted down in reverse. Left out: there is no encoder."


class Drive(Part):
    """A motor with its controller: run, reverse, trip and reset, ramps, an encoder."""

    acceleration: Positive = quantity("Largest change of speed per second, up or down.", "m/s^2")
    jerk: Positive | None = quantity(_JERK, "m/s^3", default=None)
    pulses_per_metre: Positive | None = quantity(_PULSES, "1/m", default=None)


class SpeedSetpoint(DevicePart):
    """A part that runs at a commanded speed."""

    speed: Number = quantity("Speed at the start, positive forward.", "m/s", default=0.0)
    speed_limits: Limits = quantity("Smallest and largest speed that a command may set.", "m/s", default=(-3.0, 3.0))
    watchdog: Positive | None = quantity(
        "Without a speed command for this long, it stops. Left out: it keeps its speed.", "s", default=None
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a speed beyond its limits, or limits in the wrong order."""
        least, greatest = self.speed_limits
        if least > greatest:
            text = f"{shown(self.speed_limits)} given, expected the smaller number first (m/s)"
            yield Problem((*path, "speed_limits"), text)
        elif not least <= self.speed <= greatest:
            yield Problem(
                (*path, "speed"),
                f"{shown(self.speed)} given, expected a number from {least:g} to {greatest:g} (m/s), the speed_limits",
            )


class NamedDrive(SpeedSetpoint):
    """A drive that moves all belts that name it, each at its `ratio`: run, reverse, trip and reset, ramps, an encoder.

    Speeds, limits and pulses are those of the drive, at ratio 1.
    """

    KIND: ClassVar[str] = "drive"

    acceleration: Positive | None = quantity(
        "Largest change of speed per second, up or down. Left out: it reaches the commanded speed within one tick.",
        "m/s^2",
        default=None,
    )
    jerk: Positive | None = quantity(_JERK, "m/s^3", default=None)
    pulses_per_metre: Positive | None = quantity(_PULSES, "1/m", default=None)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a jerk without an acceleration, and those of a speed setpoint."""
        yield from super().problems(path, others)
        if self.jerk is not None and self.acceleration is None:
            yield Problem((*path, "jerk"), f"{shown(self.jerk)} given without acceleration, expected both")

"""Drives of belts in a scene file."""

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Positive, quantity


class Drive(Part):
    """A motor with its controller: run, reverse, trip and reset, ramps, an encoder."""

    acceleration: Positive = quantity("Greatest change of speed in a second, speeding up or slowing down.", "m/s^2")
    jerk: Positive | None = quantity(
        "Greatest change of acceleration in a second: ramps become S-curves. Left out: there is no limit.",
        "m/s^3",
        default=None,
    )
    pulses_per_metre: Positive | None = quantity(
        "Pulses of the encoder on a metre of travel, counted down in reverse. Left out: there is no encoder.",
        "1/m",
        default=None,
    )

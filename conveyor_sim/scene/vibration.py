# SPDX-License-Identifier: Apache-2.0
"""Vibration of the chain of a belt in a scene file."""

import math

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Angle, Positive, quantity


class ChainVibration(Part):
    """A sinusoidal displacement of the surface, on top of its travel. It also acts while the belt stands."""

    amplitude: Positive = quantity("Amplitude of the displacement, half of its peak-to-peak value.", "m")
    frequency: Positive = quantity("Frequency.", "Hz")
    direction: Angle = quantity(
        "Direction of the displacement, counter-clockwise from the direction of travel. A surface that turns vibrates "
        "along travel only: 0 or half a turn.",
        "rad",
        default=0.0,
    )

    @property
    def speed(self) -> float:
        """Amplitude of the velocity, m/s."""
        return 2.0 * math.pi * self.frequency * self.amplitude

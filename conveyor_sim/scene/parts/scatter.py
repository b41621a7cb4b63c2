# SPDX-License-Identifier: Apache-2.0
"""Scatter of bottles about the place where a device puts them onto the line."""

import math
from typing import TYPE_CHECKING

from conveyor_sim.scene.parts.device_part import Giver
from conveyor_sim.scene.types import XY, NotNegative, NotNegativeAngle, quantity


class Scattered(Giver):
    """A part that puts bottles onto the line with scatter; it has the fields `direction` and `speed`."""

    if TYPE_CHECKING:
        direction: float
        speed: float

    lateral_jitter: NotNegative = quantity(
        "Largest shift of a bottle to the left or right, drawn uniformly from the seed. Left out along a "
        "conveyor: 0.5 mm, or the free distance to the guides if that is less.",
        "m",
        default=0.0,
    )
    angular_jitter: NotNegativeAngle = quantity(
        "Largest angle by which the velocity of a bottle is turned, drawn uniformly from the seed. Left out along "
        "a conveyor: 0.5 deg, or 0 if there is no free distance to the guides.",
        "rad",
        default=0.0,
    )

    @property
    def heading(self) -> tuple[float, float]:
        """Mean direction (rad) and speed (m/s) of bottles."""
        return self.direction, self.speed

    def births(self) -> tuple[XY, ...]:
        """Middle and both ends of the places of bottles, m."""
        (x, y), left = self.position, (-math.sin(self.direction), math.cos(self.direction))
        sideways = (self.lateral_jitter * left[0], self.lateral_jitter * left[1])
        return (x - sideways[0], y - sideways[1]), (x, y), (x + sideways[0], y + sideways[1])

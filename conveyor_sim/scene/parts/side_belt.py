# SPDX-License-Identifier: Apache-2.0
"""Side belts of a scene file: timing belts and side grippers beside the path of bottles."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import DevicePart, Others, line_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Limits, Name, Number, Point, Positive, quantity
from conveyor_sim.scene.words import shown


class SideBelt(DevicePart):
    """A straight belt on edge, whose surface runs from `from` to `to` at positive speed.

    One alone guides and drives bottles; two that face each other grip them.
    """

    KIND: ClassVar[str] = "side_belt"

    material: Name = quantity("Material, as named in `contacts`.")
    from_: Point = quantity("One end of the surface that touches bottles.", "m", alias="from")
    to: Point = quantity("The other end.", "m")
    speed: Number = quantity("Speed of the surface at the start.", "m/s", default=0.0)
    speed_limits: Limits = quantity("Smallest and largest speed that a command may set.", "m/s", default=(-3.0, 3.0))
    acceleration: Positive | None = quantity(
        "Largest change of speed per second, up or down. Left out: it reaches the commanded speed within one tick.",
        "m/s^2",
        default=None,
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of a line without length, and of a speed beyond its limits."""
        yield from line_problems(path, self.from_, self.to)
        least, greatest = self.speed_limits
        if least > greatest:
            text = f"{shown(self.speed_limits)} given, expected the smaller number first (m/s)"
            yield Problem((*path, "speed_limits"), text)
        elif not least <= self.speed <= greatest:
            text = (
                f"{shown(self.speed)} given, expected a number from {least:g} to {greatest:g} (m/s), the speed_limits"
            )
            yield Problem((*path, "speed"), text)

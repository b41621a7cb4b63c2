# SPDX-License-Identifier: Apache-2.0
"""Spills of a scene file: bottles that a test drops."""

from typing import ClassVar

from conveyor_sim.scene.parts.device_part import Entry
from conveyor_sim.scene.types import Count, Name, Point, quantity


class Spill(Entry):
    """A place where a test can have bottles dropped onto the line."""

    KIND: ClassVar[str] = "spill"

    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Position of the axis; the bottle is at rest.", "m")
    count: Count = quantity("Largest number of bottles.", "1", default=1)

    @property
    def most(self) -> int | None:
        """Largest number of dropped bottles."""
        return self.count

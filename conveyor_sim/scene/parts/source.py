# SPDX-License-Identifier: Apache-2.0
"""Sources of a scene file: machines upstream."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from conveyor_sim.scene.parts.bad import BadBottles
from conveyor_sim.scene.parts.device_part import Entry, Others
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.parts.switched import SwitchedTypes
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Name, NotNegative, Point, quantity


class Source(PackmlPart, SwitchedTypes, Scattered, BadBottles, Entry):
    """A machine upstream, such as a filler. It gives bottles at a rate; without room it is blocked."""

    KIND: ClassVar[str] = "source"

    kind: Literal["source"] = quantity("The kind of machine.")
    bottle: Name = quantity("Bottle type.")
    position: Point = quantity("Position of the axis of a new bottle.", "m")
    direction: Angle = quantity("Direction of its velocity.", "rad")
    speed: NotNegative = quantity(
        "Initial speed along `direction`. Left out along a conveyor: the speed of the belt.", "m/s"
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of a rate beyond its limit, and of bad bottles given in two ways."""
        yield from super().problems(path, others)
        yield from self.bad_problems(path)
        yield from self.type_problems(path)

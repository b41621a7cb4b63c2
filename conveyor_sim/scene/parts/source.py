# SPDX-License-Identifier: Apache-2.0
"""Sources of a scene file: machines upstream."""

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.parts.bad import BadBottles
from conveyor_sim.scene.parts.device_part import Entry, Others, name_problems
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.scatter import Scattered
from conveyor_sim.scene.parts.switched import SwitchedTypes
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import XY, Angle, Count, Holds, Name, NotNegative, Point, Positive, quantity


class Layer(Part):
    """Rows of bottles that a depalletiser sets down at once, at rest, from its position on."""

    rows: Count = quantity("Number of rows.", "1")
    columns: Count = quantity("Bottles in a row, along `direction`.", "1")
    pitch: Positive = quantity("Distance between neighbours in a row.", "m")
    pattern: Literal["square", "hexagonal"] = quantity(
        "square: rows a pitch apart; hexagonal: every second row shifted by half a pitch, rows sqrt(3)/2 pitch apart. "
        "Rows grow to the left.",
        default="square",
    )
    pusher: Name | None = quantity(
        "Pusher that sweeps the layer off. It must be retracted before the next layer.", default=None
    )

    def offsets(self) -> tuple[XY, ...]:
        """Return the places of its bottles from the first one, row by row: along and to the left, m."""
        hexagonal = self.pattern == "hexagonal"
        step = math.sqrt(0.75) if hexagonal else 1.0
        return tuple(
            (self.pitch * (column + 0.5 * (row % 2 and hexagonal)), self.pitch * step * row)
            for row in range(self.rows)
            for column in range(self.columns)
        )


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
    layer: Annotated[Layer | None, Holds("a mapping with the fields " + ", ".join(Layer.model_fields))] = quantity(
        "Layer of bottles that it sets down at once, as a depalletiser does, in a cycle of rows x columns / rate. "
        "Left out: one bottle.",
        default=None,
    )

    def births(self) -> tuple[XY, ...]:
        """Return the places of new bottles, or the outermost ones, m."""
        if self.layer is None:
            return super().births()
        ahead, left = (math.cos(self.direction), math.sin(self.direction)), math.pi / 2.0 + self.direction
        aside = math.cos(left), math.sin(left)
        return tuple(
            (x + along * ahead[0] + across * aside[0], y + along * ahead[1] + across * aside[1])
            for x, y in super().births()
            for along, across in self.layer.offsets()
        )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of a rate beyond its limit, and of bad bottles given in two ways."""
        yield from super().problems(path, others)
        yield from self.bad_problems(path)
        if self.layer is not None:
            yield from name_problems((*path, "layer", "pusher"), self.layer.pusher, "pushers", others)
        yield from self.type_problems(path)

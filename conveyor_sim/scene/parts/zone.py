# SPDX-License-Identifier: Apache-2.0
"""Zones of a scene file."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import DevicePart, Mark, Others, polygon_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Count, PolygonList, quantity


class Zone(DevicePart):
    """A region in which bottles are counted: those whose axis is inside."""

    KIND: ClassVar[str] = "zone"

    region: PolygonList = quantity("Corners of the region in order: a simple polygon.", "m")
    full_at: Count | None = quantity(
        "A back-up switch: `full` is on while the zone has at least this many bottles. Left out: none.",
        "1",
        default=None,
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for an invalid region."""
        yield from polygon_problems((*path, "region"), self.region)

    def mark(self, name: str) -> Mark:
        """Return its region."""
        return self._mark("region", name, self.region)

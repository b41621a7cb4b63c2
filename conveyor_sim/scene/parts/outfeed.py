# SPDX-License-Identifier: Apache-2.0
"""Outfeeds of a scene file."""

from typing import ClassVar

from conveyor_sim.scene.parts.device_part import Exit
from conveyor_sim.scene.types import PolygonList, quantity


class Outfeed(Exit):
    """A region that removes the bottles whose axis is inside."""

    KIND: ClassVar[str] = "outfeed"

    region: PolygonList = quantity("Corners of the region in order: a simple polygon.", "m")

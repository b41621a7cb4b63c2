# SPDX-License-Identifier: Apache-2.0
"""Rejects of a scene file: machines that throw bottles out."""

from typing import ClassVar, Literal

from conveyor_sim.scene.parts.device_part import Exit
from conveyor_sim.scene.types import NotNegative, PolygonList, Positive, quantity


class Reject(Exit):
    """A machine that rejects the first bottle whose axis is in a region after it was fired."""

    KIND: ClassVar[str] = "reject"

    kind: Literal["reject"] = quantity("The kind of machine.")
    region: PolygonList = quantity("Where it hits a bottle: a simple polygon.", "m")
    delay: NotNegative = quantity("From the command to the stroke.", "s", default=0.0)
    window: Positive = quantity("How long the stroke can hit.", "s", default=0.02)

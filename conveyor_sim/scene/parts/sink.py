# SPDX-License-Identifier: Apache-2.0
"""Sinks of a scene file: machines downstream."""

from typing import ClassVar, Literal

from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.types import Count, quantity


class Sink(TakingPart):
    """A machine downstream, such as a packer. It takes bottles out of a region, one or several at once, at most at a
    rate.

    Waiting bottles press on the rail at the end of the region.
    """

    KIND: ClassVar[str] = "sink"

    kind: Literal["sink"] = quantity("The kind of machine.")
    at_once: Count = quantity(
        "Bottles that it takes at once, such as those of a case or a tray. Its cycle lasts at_once / rate.",
        "1",
        default=1,
    )

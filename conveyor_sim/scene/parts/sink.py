# SPDX-License-Identifier: Apache-2.0
"""Sinks of a scene file: machines downstream."""

from typing import ClassVar, Literal

from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.types import quantity


class Sink(TakingPart):
    """A machine downstream, such as a packer. It takes single bottles out of a region, at most at a rate.

    Waiting bottles press on the rail at the end of the region.
    """

    KIND: ClassVar[str] = "sink"

    kind: Literal["sink"] = quantity("The kind of machine.")

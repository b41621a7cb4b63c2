"""Sinks of a scene file: machines downstream."""

from typing import ClassVar, Literal

from conveyor_sim.scene.parts.machine import TakingPart
from conveyor_sim.scene.types import quantity


class Sink(TakingPart):
    """A machine downstream, such as a packer: takes one bottle after another out of a region, at most at a rate.

    Those that wait press on whatever stands at the end of the region: a rail.
    """

    KIND: ClassVar[str] = "sink"

    kind: Literal["sink"] = quantity("The kind of machine.")

"""What is drawn of the devices of a scene, as their parts say."""

from typing import get_args

from conveyor_sim.scene.parts.device_part import Look, Mark
from conveyor_sim.scene.schema import Scene

LOOKS: tuple[Look, ...] = get_args(Look)
"""In the order in which they are listed."""


def marks_of(scene: Scene) -> list[Mark]:
    """Of every device that is drawn by a mark, by look, then in listing order."""
    found = (mark for (_, name), part in scene.devices() for mark in part.marks(name))
    return sorted(found, key=lambda mark: LOOKS.index(mark.look))

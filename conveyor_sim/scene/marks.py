# SPDX-License-Identifier: Apache-2.0
"""Marks of a scene's devices in pictures."""

from typing import get_args

from conveyor_sim.scene.parts.device_part import Look, Mark
from conveyor_sim.scene.schema import Scene

LOOKS: tuple[Look, ...] = get_args(Look)
"""All looks in listing order."""


def marks_of(scene: Scene) -> list[Mark]:
    """Return the marks of all devices, by look, then in listing order."""
    found = (mark for (_, name), part in scene.devices() for mark in part.marks(name))
    return sorted(found, key=lambda mark: LOOKS.index(mark.look))

# SPDX-License-Identifier: Apache-2.0
"""Marks of a scene's devices in pictures."""

from typing import get_args

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.scene.parts.carousel import Carousel
from conveyor_sim.scene.parts.device_part import Look, Mark
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.star_places import Wheel, wheels_of

LOOKS: tuple[Look, ...] = get_args(Look)
"""All looks in listing order."""

CORNERS = 24
"""Corners along each arc of the outline of a carousel."""


def marks_of(scene: Scene) -> list[Mark]:
    """Return the marks of all devices, by look, then in listing order."""
    found = [mark for (_, name), part in scene.devices() for mark in part.marks(name)]
    wheels = wheels_of(scene.stars)
    found += [
        Mark("region", Carousel.KIND, name, _swept(wheels[part.star], part), word=Carousel.KIND)
        for name, part in scene.carousels.items()
        if part.star in wheels
    ]
    return sorted(found, key=lambda mark: LOOKS.index(mark.look))


def _swept(wheel: Wheel, carousel: Carousel) -> NDArray[np.float64]:
    """Return the outline of the places of pockets between the angles of a carousel, (k, 2), m."""
    angles = np.linspace(carousel.from_, carousel.to, CORNERS)
    arc = np.array([wheel.point(angle) for angle in angles]) - wheel.centre
    scale = wheel.part.pocket_radius / wheel.part.pitch_radius
    return np.concatenate([arc * (1.0 - scale), arc[::-1] * (1.0 + scale)]) + wheel.centre

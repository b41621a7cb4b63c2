# SPDX-License-Identifier: Apache-2.0
"""Plates of a scene file: surfaces at rest, such as a dead plate between two belts."""

from typing import Annotated

from pydantic import Tag

from conveyor_sim.scene.areas import CurvedArea, StraightArea
from conveyor_sim.scene.part import one_of
from conveyor_sim.scene.types import Name, quantity

_MATERIAL = "Material, as named in `base`."


class StraightPlate(StraightArea):
    """A rectangle at rest."""

    material: Name = quantity(_MATERIAL)


class CurvedPlate(CurvedArea):
    """A sector of a ring at rest, given either by `centre`, `start_angle` and `span`, or by `from`, `to` and `side`."""

    material: Name = quantity(_MATERIAL)


Plate = Annotated[
    Annotated[StraightPlate, Tag("(straight)")] | Annotated[CurvedPlate, Tag("(curved)")],
    one_of({"straight": "(straight)", "curved": "(curved)"}),
]

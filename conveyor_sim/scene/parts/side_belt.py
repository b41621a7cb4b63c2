# SPDX-License-Identifier: Apache-2.0
"""Side belts of a scene file: timing belts and side grippers beside the path of bottles."""

import math
from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import SerializerFunctionWrapHandler, model_serializer

from conveyor_sim.scene.parts.device_part import DevicePart, Others, line_problems, name_problems
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Limits, Name, Number, Point, Positive, quantity
from conveyor_sim.scene.words import shown

_OF_AXIS = ("speed", "speed_limits", "acceleration")
"""Fields that belong to the axis if a side belt names one."""


class SideBelt(DevicePart):
    """A straight belt on edge, whose surface runs from `from` to `to` at positive speed.

    One alone guides and drives bottles; two that face each other grip them.
    """

    KIND: ClassVar[str] = "side_belt"

    material: Name = quantity("Material, as named in `contacts`.")
    from_: Point = quantity("One end of the surface that touches bottles.", "m", alias="from")
    to: Point = quantity("The other end.", "m")
    speed: Number = quantity("Speed of the surface at the start.", "m/s", default=0.0)
    speed_limits: Limits = quantity("Smallest and largest speed that a command may set.", "m/s", default=(-3.0, 3.0))
    acceleration: Positive | None = quantity(
        "Largest change of speed per second, up or down. Left out: it reaches the commanded speed within one tick.",
        "m/s^2",
        default=None,
    )

    axis: Name | None = quantity("Axis that moves it, instead of a drive. It needs `travel`.", default=None)
    travel: Positive | None = quantity("Travel of the surface per cycle of the `axis`.", "m", default=None)

    @property
    def travel_per_radian(self) -> float:
        """Travel of the surface per angle of its axis, m/rad; 0 without one."""
        return (self.travel or 0.0) / (2.0 * math.pi)

    @model_serializer(mode="wrap")
    def _without_foreign_fields(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the fields that this belt can't have, so that a scene can be read again from its fields."""
        foreign = ("axis", "travel") if self.axis is None else _OF_AXIS
        return {name: value for name, value in handler(self).items() if name not in foreign}

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of a line without length, of a speed beyond its limits, and of fields without their axis."""
        yield from line_problems(path, self.from_, self.to)
        yield from name_problems((*path, "axis"), self.axis, "axes", others)
        if self.axis is not None:
            yield from self._axis_problems(path, self.axis)
            return
        if self.travel is not None:
            yield Problem((*path, "travel"), f"{shown(self.travel)} given, expected it only with axis")
        least, greatest = self.speed_limits
        if least > greatest:
            text = f"{shown(self.speed_limits)} given, expected the smaller number first (m/s)"
            yield Problem((*path, "speed_limits"), text)
        elif not least <= self.speed <= greatest:
            text = (
                f"{shown(self.speed)} given, expected a number from {least:g} to {greatest:g} (m/s), the speed_limits"
            )
            yield Problem((*path, "speed"), text)

    def _axis_problems(self, path: Path, axis: str) -> Iterator[Problem]:
        """Yield problems of a belt that an axis moves."""
        if self.travel is None:
            yield Problem((*path, "travel"), "none given with axis, expected the travel per cycle of the axis (m)")
        for field in _OF_AXIS:
            if field in self.model_fields_set:
                value = getattr(self, field)
                yield Problem((*path, field), f"{shown(value)} given, expected none here: axes.{axis} has it")

# SPDX-License-Identifier: Apache-2.0
"""Carousels of a scene file: star wheels whose pockets work on the bottles that they carry."""

from collections.abc import Iterator
from typing import ClassVar

from conveyor_sim.scene.parts.device_part import Others, name_problems
from conveyor_sim.scene.parts.work import Working
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Angle, Name, quantity
from conveyor_sim.scene.words import shown

ROUNDING = 1e-9
"""Tolerance of angles and radii against rounding: 360 deg written in radians."""


class Carousel(Working):
    """Tools of a star wheel, one for each pocket, such as valves of a filler or heads of a capper. They work on carried
    bottles between two angles.
    """

    KIND: ClassVar[str] = "carousel"

    star: Name = quantity("Star wheel with the tools, as named in `stars`.")
    from_: Angle = quantity("Angle after the wheel's `entry` at which work on a bottle begins.", "rad", alias="from")
    to: Angle = quantity(
        "Angle after the wheel's `entry` at which it ends: the bottle has its new type and attributes from there on.",
        "rad",
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield further problems: angles beyond the wheel's path, an unknown wheel, and types of other radii."""
        yield from super().problems(path, others)
        yield from name_problems((*path, "star"), self.star, "stars", others)
        yield from self.work_problems(path, others)
        if self.from_ < 0.0:
            yield Problem((*path, "from"), f"{shown(self.from_)} given, expected 0 or more (rad), from the entry on")
        if self.to <= self.from_:
            yield Problem((*path, "to"), f"{shown(self.to)} given, expected more than {self.from_:g} (rad), as from is")
        star = others["stars"].get(self.star)
        if star is not None and self.to > star.carry + ROUNDING:
            text = f"{shown(self.to)} given, expected at most {star.carry:g} (rad)"
            yield Problem((*path, "to"), f"{text}: bottles leave stars.{self.star} there")
        types = others["bottle_types"]
        for before, after in self.changes.items():
            if before in types and after in types and abs(types[before].radius - types[after].radius) > ROUNDING:
                text = (
                    f"{shown(after)} given, expected a type of the same radius, {types[before].radius:g} m: the bottle "
                    "stays in its pocket"
                )
                yield Problem((*path, "changes", before), text)

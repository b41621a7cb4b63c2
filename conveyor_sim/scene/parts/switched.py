# SPDX-License-Identifier: Apache-2.0
"""Fields of parts that feed bottles of several types, one after the other."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Holds, Name, quantity
from conveyor_sim.scene.words import listed, shown


class SwitchedTypes(Part):
    """A part whose bottle type a command can change in a run."""

    if TYPE_CHECKING:
        bottle: str

    types: Annotated[tuple[Name, ...], Holds("a list of bottle types")] = quantity(
        "Bottle types from which the command `cmd_bottle` selects in a run, numbered from 0; `bottle` is one of "
        "them. Left out: there is no such command.",
        default=(),
    )

    @property
    def kinds(self) -> tuple[str, ...]:
        """Types of its bottles."""
        return self.types or (self.bottle,)

    def type_problems(self, path: Path) -> Iterator[Problem]:
        """Yield problems of a type that is not listed, or listed twice."""
        if self.types and self.bottle not in self.types:
            yield Problem((*path, "bottle"), f"{shown(self.bottle)} given, expected one of {listed(list(self.types))}")
        if len(set(self.types)) < len(self.types):
            yield Problem((*path, "types"), f"{shown(list(self.types))} given, expected each type once")

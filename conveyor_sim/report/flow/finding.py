# SPDX-License-Identifier: Apache-2.0
"""Findings of a check: facts about a scene that its author should know, each with its place in the file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from conveyor_sim.scene.places import Places
from conveyor_sim.scene.problems import Path, dotted

Level = Literal["warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One finding, at a field of the scene."""

    path: Path
    text: str
    level: Level = "warning"

    def line(self, places: Places) -> str:
        """Return the finding with file, line and field; of an expanded part those of the part that was written."""
        place = places.place_of(self.path)
        return f"{place}: {dotted(place.path or self.path)}: {self.text}"


def at(point: tuple[float, float]) -> str:
    """Return a place in m, in words."""
    return f"({point[0]:.2f}, {point[1]:.2f}) m"


def in_mm(metres: float) -> str:
    """Return a length in mm, in words."""
    return f"{1e3 * metres:.3g} mm"

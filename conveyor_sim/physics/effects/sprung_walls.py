# SPDX-License-Identifier: Apache-2.0
"""Straight rails that carry a part of a queue by tangential springs, where loads on bottles are in question.

Karim and Corwin (Phys. Rev. Lett. 112, 188001, 2014) found on a belt that straight side walls carry nothing.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass

from conveyor_sim.physics.effects.contacts import contacts_in_use
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene.geometry import BeltShape, SegmentPiece
from conveyor_sim.scene.problems import Path, dotted

PARALLEL = math.sin(math.radians(5.0))
"""Largest sine of the angle between a rail and the travel of a belt that counts as parallel."""

LONG = 4.0
"""Shortest length of a rail along a belt, in bottle diameters. A shorter one carries little."""


@dataclass(frozen=True)
class SprungWalls:
    """A contact with springs at straight rails along a belt."""

    path: Path
    """Field of the scene with the springs."""
    rail: str
    """Name of the first of these rails."""

    @property
    def text(self) -> str:
        """Warning without the path."""
        return (
            f"springs at {self.rail} carry a part of a queue, and loads on bottles come out too small: on a belt, "
            "straight walls carried nothing (docs/validation.md); leave tangential out of contacts with straight rails "
            "for crushing"
        )

    @property
    def sentence(self) -> str:
        """The warning, with the path."""
        return f"{dotted(self.path)}: {self.text}"


def sprung_walls(plant: Plant, on: Collection[str]) -> SprungWalls | None:
    """Return the first contact with springs at straight rails along a belt, if loads on bottles are measured.

    That is the case with the effect `crushing` or a limit of the contact force. None without such a contact. on:
    enabled effects.
    """
    asks = "crushing" in on or plant.scene.limits.impact_force is not None
    if not asks or not {"tangential_spring", "base_friction", "belts"} <= set(on):
        return None
    belts = [shape for shape in plant.surfaces if shape.belt is not None and shape.kind == "straight"]
    for index, contact in contacts_in_use(plant, on):
        if contact.tangential is None:
            continue
        for rail in plant.rails_at_rest:
            if rail.material in contact.between and any(
                isinstance(piece, SegmentPiece) and _along(piece, belt, _diameter(plant))
                for piece in rail.pieces
                for belt in belts
            ):
                return SprungWalls(("contacts", index, "tangential"), rail.name)
    return None


def _diameter(plant: Plant) -> float:
    return 2.0 * max(kind.radius for kind in plant.scene.bottle_types.values())


def _along(piece: SegmentPiece, belt: BeltShape, diameter: float) -> bool:
    """Return True if a rail runs along a straight belt, beside the bottles on it, for LONG diameters (m)."""
    cosine, sine = math.cos(belt.angle), math.sin(belt.angle)
    (x1, y1), (x2, y2) = (
        (cosine * dx + sine * dy, cosine * dy - sine * dx)
        for dx, dy in ((x - belt.corner[0], y - belt.corner[1]) for x, y in (piece.p1, piece.p2))
    )
    length = min(max(x1, x2), belt.length) - max(min(x1, x2), 0.0)
    beside = -diameter <= 0.5 * (y1 + y2) <= belt.width + diameter
    return beside and length >= LONG * diameter and abs(y2 - y1) <= PARALLEL * math.hypot(x2 - x1, y2 - y1)

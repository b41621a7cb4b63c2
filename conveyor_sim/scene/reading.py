# SPDX-License-Identifier: Apache-2.0
"""`Reading`: the plain data of a scene after all stages, with the place of each field."""

from collections.abc import Iterable
from typing import Any

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.layout.compose import Composition
from conveyor_sim.scene.layout.expand import Expansion, expand
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.provenance import FieldPlace, Provenance, inside
from conveyor_sim.scene.refusal import refused


class Reading:
    """Composed data and their expansion."""

    def __init__(self, composition: Composition, data: Any) -> None:
        """Expand composed data. data: those of the composition with tables read."""
        self.composition = composition
        self.expansion = expand(data) if isinstance(data, dict) else Expansion(data)
        self._provenance = Provenance(self.expansion.sources)

    def place_of(self, path: Path) -> FieldPlace:
        """Return the place of a field of the expanded scene, or of the nearest one above it."""
        composed, rest = self._composed(path)
        place = self.composition.sources.place_of(composed)
        return FieldPlace(place.file, place.line, place.path, place.cell, path if rest else ())

    def is_written(self, path: Path) -> bool:
        """Return True if a field of the expanded scene is written in a file or an override."""
        composed, rest = self._composed(path)
        if rest or not inside(self.composition.data, composed):
            return False
        file, source = self.composition.sources.origin_of(composed)
        return inside(file.document.data, source)

    def refused(self, problems: Iterable[Problem], more: int = 0) -> SceneError:
        """Return the error for problems of the expanded scene. more: number of those that were only counted."""
        return refused(problems, self.place_of, self.composition.sources.main.name, more)

    def _composed(self, path: Path) -> tuple[Path, Path]:
        """Return the path in the composed data that a path comes from, and the rest that is not in these data."""
        source, rest = self._provenance.split(path)
        while rest and inside(self.composition.data, (*source, rest[0])):
            source, rest = (*source, rest[0]), rest[1:]
        return source, rest

# SPDX-License-Identifier: Apache-2.0
"""Place of a scene's field in its file."""

from conveyor_sim.scene.load import reread
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.provenance import FieldPlace
from conveyor_sim.scene.schema import Scene


class Places:
    """Places of one scene. Its text is read again, because scenes do not store lines."""

    def __init__(self, scene: Scene) -> None:
        self._reading = reread(scene)

    def line_of(self, path: Path) -> int | None:
        """Return the line (from 1) of a field, or of the nearest one above; None if it was overridden or left out."""
        return self._reading.place_of(path).line if self._reading.is_written(path) else None

    def of(self, path: Path) -> str:
        """Return the place such as `plant.yaml:7`, or `plant.yaml (override)`."""
        return str(self._reading.place_of(path))

    def place_of(self, path: Path) -> FieldPlace:
        """Return the place of a field of the expanded scene, or of the nearest one above it."""
        return self._reading.place_of(path)

    def elsewhere(self, path: Path) -> str:
        """Return the place of a field in another file such as `cells/filler.yaml:4 (cell block)`; else ""."""
        place = self._reading.place_of(path)
        return "" if place.file == self._reading.composition.sources.main.name else str(place)

    def unwritten(self, path: Path) -> str:
        """Return the origin of a field without a line: `override` or `default`."""
        return "override" if self._reading.place_of(path).line is None else "default"

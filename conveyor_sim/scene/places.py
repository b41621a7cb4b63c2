"""Place of a scene's field in its file."""

from conveyor_sim.scene.load import holds, parse_overrides
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.yaml_lines import Document


class Places:
    """Places of one scene. Its text is read again, because scenes do not store lines."""

    def __init__(self, scene: Scene) -> None:
        self._name = scene.source_name
        self._document = Document(scene.source_text or "{}", self._name)
        self._given = parse_overrides(scene.given_overrides)

    def line_of(self, path: Path) -> int | None:
        """Return the line (from 1) of a field, or of the nearest one above; None if it was overridden or left out."""
        if holds(self._given, path) or not self._written(path):
            return None
        return self._document.line_of(path)

    def of(self, path: Path) -> str:
        """Return the place such as `plant.yaml:7`, or `plant.yaml (override)`."""
        if holds(self._given, path):
            return f"{self._name} (override)"
        return f"{self._name}:{self._document.line_of(path)}"

    def unwritten(self, path: Path) -> str:
        """Return the origin of a field without a line: `override` or `default`."""
        return "override" if holds(self._given, path) else "default"

    def _written(self, path: Path) -> bool:
        data = self._document.data
        for part in path:
            inside = isinstance(data, dict) and part in data
            if not inside and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
                return False
            data = data[part]
        return True

"""Files of a composed scene: read once, with limits on their number and size."""

import posixpath

from conveyor_sim.scene.beside import Beside
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.support.files import in_mb

_MOST_FILES = 1000
MOST_NESTED = 20
"""Largest number of files that include each other, or of cells in cells."""


class Files:
    """Files that a scene includes or uses as cells."""

    def __init__(self, beside: Beside, scene: str) -> None:
        """scene: name of the scene's file for errors."""
        self._beside, self._folder = beside, posixpath.dirname(scene)
        self.main = posixpath.basename(scene)
        """Path of the scene from its folder."""
        self._documents: dict[str, Document] = {}
        self._size = 0

    def key(self, path: str, beside: str) -> str:
        """Return a path from the scene's folder. path: as written; beside: the file that it is written in."""
        return posixpath.normpath(posixpath.join(posixpath.dirname(beside), path))

    def name(self, key: str) -> str:
        """Return the name of a file for errors."""
        return posixpath.join(self._folder, key)

    def document(self, key: str, kind: str) -> Document:
        """Return a parsed file. kind: words for the error. Raise ValueError if it can't be read, or SceneError."""
        if key not in self._documents:
            if len(self._documents) >= _MOST_FILES:
                raise ValueError(f"expected at most {_MOST_FILES} files in a scene")
            content, _ = self._beside.read(key, LONGEST_TEXT, kind)
            self._size += len(content)
            if self._size > LONGEST_TEXT:
                raise ValueError(f"expected files of at most {in_mb(LONGEST_TEXT)} together")
            try:
                text = content.decode("utf-8")
            except UnicodeDecodeError:
                raise ValueError(f"expected {kind} in UTF-8") from None
            document = Document(text, self.name(key))
            if not isinstance(document.data, dict):
                raise ValueError(f"expected {kind}, a mapping of fields of a scene")
            self._documents[key] = document
        return self._documents[key]

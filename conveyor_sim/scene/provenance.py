"""Provenance of a scene's data: the file and line that each field of the read scene comes from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.scene.overrides import holds
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.yaml_lines import Document


@dataclass(frozen=True)
class Place:
    """Place of a field in a file."""

    file: str
    line: int | None
    """Line (from 1); None: the field was overridden."""
    path: Path
    """Path of the field in its file, or of the nearest one above it."""
    cell: str = ""
    """Name of the cell that the file was read for; "" outside cells."""
    expanded: Path = ()
    """Path of the expanded scene, where it names more than `path`."""

    def __str__(self) -> str:
        """Return the place such as `plant.yaml:7`, or `plant.yaml (override)`."""
        if self.line is None:
            return f"{self.file} (override)"
        return f"{self.file}:{self.line} (cell {self.cell})" if self.cell else f"{self.file}:{self.line}"


class Provenance:
    """Map from paths of later data to paths of the earlier data that they were made from."""

    def __init__(self, sources: Mapping[Path, Path] | None = None) -> None:
        self._sources = dict(sources or {})

    def add(self, path: Path, source: Path) -> None:
        """Set the source of a path and of all paths below it."""
        self._sources[path] = source

    def split(self, path: Path) -> tuple[Path, Path]:
        """Return the source of the longest known prefix of a path, and the rest of the path; itself if unknown."""
        for length in range(len(path), 0, -1) if self._sources else ():
            if (source := self._sources.get(path[:length])) is not None:
                return source, path[length:]
        return path, ()

    def source_of(self, path: Path) -> Path:
        """Return the path in the earlier data: that of the longest known prefix, followed by the rest."""
        source, rest = self.split(path)
        return (*source, *rest)


@dataclass(frozen=True)
class SourceFile:
    """A file that a scene was read from."""

    name: str
    """Name for errors."""
    document: Document
    cell: str = ""
    """Name of the cell that the file was read for."""


class Sources:
    """Files of a scene and its overrides: the place of each field of the composed data."""

    def __init__(self, document: Document, name: str, changes: Any = None) -> None:
        """Start with the scene's own file. changes: overrides."""
        self.main = SourceFile(name, document)
        self.changes = changes or {}
        self._origins: dict[Path, tuple[SourceFile, Path]] = {}

    def add(self, path: Path, file: SourceFile, source: Path) -> None:
        """Set the file of a path and of all paths below it, and its path in this file."""
        self._origins[path] = file, source

    def items(self) -> Iterable[tuple[Path, tuple[SourceFile, Path]]]:
        """Return the origins that differ from the scene's own file, by path."""
        return self._origins.items()

    def place_of(self, path: Path) -> Place:
        """Return the place of a field of the composed data, or of the nearest one above it."""
        if holds(self.changes, path):
            return Place(self.main.name, None, path)
        file, source = self.origin_of(path)
        return Place(file.name, file.document.line_of(source), source, file.cell)

    def origin_of(self, path: Path) -> tuple[SourceFile, Path]:
        """Return the file of a field of the composed data, and its path in this file."""
        for length in range(len(path), 0, -1) if self._origins else ():
            if (origin := self._origins.get(path[:length])) is not None:
                return origin[0], (*origin[1], *path[length:])
        return self.main, path


def inside(data: Any, path: Path) -> bool:
    """Return True if plain data have a value at a path."""
    for part in path:
        is_there = isinstance(data, dict) and part in data
        if not is_there and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            return False
        data = data[part]
    return True

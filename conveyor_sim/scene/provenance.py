# SPDX-License-Identifier: Apache-2.0
"""Provenance of a scene's data: the file and line that each field of the read scene comes from."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from conveyor_sim.scene.overrides import holds
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.yaml_lines import Document


@dataclass(frozen=True)
class FieldPlace:
    """FieldPlace of a field in a file."""

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


@dataclass(frozen=True, eq=False)
class SceneFile:
    """A file that a scene was read from."""

    name: str
    """Name for errors."""
    document: Document
    cell: str = ""
    """Name of the cell that the file was read for."""
    key: str = ""
    """Path from the scene's folder."""


class Sources:
    """Files of a scene and its overrides: the place of each field of the composed data."""

    def __init__(self, main: SceneFile, changes: Any = None) -> None:
        """Start with one file, from which all fields without another origin come. changes: overrides."""
        self.main = main
        self.changes = changes or {}
        self._origins: dict[Path, tuple[SceneFile, Path]] = {}
        self._below: dict[Path, list[Path]] = {}

    def empty(self) -> "Sources":
        """Return the same file and overrides without other origins."""
        return Sources(self.main, self.changes)

    def add(self, path: Path, file: SceneFile, source: Path) -> None:
        """Set the file of a path and of all paths below it, and its path in this file."""
        if path not in self._origins:
            for length in (1, 2) if len(path) > 2 else range(1, len(path)):
                self._below.setdefault(path[:length], []).append(path)
        self._origins[path] = file, source

    def adopt(self, path: Path, other: "Sources", old: Path) -> None:
        """Take over the origins of a path of other data, which has one or two parts, and of all paths below it."""
        if (origin := other.origin_of(old)) != self.origin_of(path):
            self.add(path, *origin)
        for deeper in other._below.get(old, ()):
            self.add((*path, *deeper[len(old) :]), *other._origins[deeper])

    def place_of(self, path: Path) -> FieldPlace:
        """Return the place of a field of the composed data, or of the nearest one above it."""
        if holds(self.changes, path):
            return FieldPlace(self.main.name, None, path)
        file, source = self.origin_of(path)
        return FieldPlace(file.name, file.document.line_of(source), source, file.cell)

    def origin_of(self, path: Path) -> tuple[SceneFile, Path]:
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

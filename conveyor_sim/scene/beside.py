# SPDX-License-Identifier: Apache-2.0
"""Files that a scene names: read from its folder, or from a copy that a recording holds."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath

from conveyor_sim.support.files import FileError, OutsideError, read_file

OUTSIDE = "the option --outside-tables, or the parameter outside_tables of the node, allows others"


@dataclass
class Beside:
    """FieldPlace of the files that a scene names."""

    folder: FilePath | None
    """Folder of the scene, where paths start; None: no file can be read."""
    outside: bool = False
    """True if paths may lead out of the folder."""
    stored: Mapping[str, str] = field(default_factory=dict)
    """Text of files by path. These are not read again."""
    used: dict[str, bytes] = field(default_factory=dict)
    """Content of the files that were read, by path."""

    @property
    def is_none(self) -> bool:
        """True if no file can be read."""
        return self.folder is None and not self.stored

    def read(self, path: str, most: int, kind: str) -> tuple[bytes, bool]:
        """Return the content of a file of at most `most` bytes, and whether it lies inside the folder.

        kind: words for the error, such as "a CSV file". Raise ValueError with the expectation if it can't be read.
        """
        content, is_inside = self._content(path, most, kind)
        self.used[path] = content
        return content, is_inside

    def _content(self, path: str, most: int, kind: str) -> tuple[bytes, bool]:
        if path in self.stored:
            return self.stored[path].encode(), True
        if self.folder is None:
            raise ValueError(f"expected {kind}, but a scene that is no file has no files beside it")
        try:
            return read_file(FilePath(path), most, self.folder), True
        except OutsideError:
            if not self.outside:
                raise ValueError(f"which leads out of the scene's folder, expected {kind} in it; {OUTSIDE}") from None
        except FileError as error:
            raise ValueError(f"expected {kind} in {self.folder} ({error})") from None
        try:
            return read_file(self.folder / path, most), False
        except FileError as error:
            raise ValueError(f"expected {kind} ({error})") from None

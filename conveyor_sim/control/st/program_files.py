# SPDX-License-Identifier: Apache-2.0
"""Files of one program: found, read, parsed one by one, and joined to one syntax tree.

The lines of all files are numbered on, so that every position of the tree belongs to one file.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path, PurePath

from conveyor_sim.control.st import br, scl, tree
from conveyor_sim.control.st.called_programs import with_instances
from conveyor_sim.control.st.dialect import IEC, SUFFIXES, Dialect
from conveyor_sim.control.st.errors import Position, SourceError, StructuredTextError
from conveyor_sim.control.st.foreign import refused_file
from conveyor_sim.control.st.parse import parse
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import SENTENCE, printable

Paths = str | PathLike[str] | Sequence[str | PathLike[str]]
"""A file, a folder with the files of a program, or several of both."""

MOST_BYTES = 2 * MB
"""Largest size of all files of a program, bytes."""

MOST_FILES = 2000
"""Largest number of files of a program."""

MOST_ENTRIES = 50_000
"""Largest number of files and folders that are looked at in a folder."""

_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True)
class Text:
    """Text of a file."""

    file: str
    text: str


@dataclass(frozen=True)
class ProgramFiles:
    """Files of a program, with the numbers of their first lines in the tree."""

    names: tuple[str, ...]
    starts: tuple[int, ...]

    def place(self, at: Position) -> str:
        """Return file, line and column of a position of the tree."""
        index = bisect_right(self.starts, at.line) - 1
        return f"{self.names[index]}:{at.line - self.starts[index] + 1}:{at.column}"

    def error(self, error: SourceError) -> StructuredTextError:
        """Return the error for the user, with its place."""
        return StructuredTextError(f"{self.place(error.at)}: {printable(error, SENTENCE)}")


def paths_of(paths: Paths) -> list[Path]:
    """Return the files that paths name, sorted. Raise StructuredTextError for a folder without any."""
    named = [paths] if isinstance(paths, (str, PathLike)) else list(paths)
    files: set[Path] = set()
    for path in map(Path, named):
        if not path.is_dir():
            files.add(path)
            continue
        inside = {file for file in _everything(path) if file.suffix.lower() in SUFFIXES and file.is_file()}
        if not inside:
            types = ", ".join(SUFFIXES)
            raise StructuredTextError(f"{path}: is a folder without a program in Structured Text, expected {types}")
        files |= inside
    if not files:
        raise StructuredTextError("found no file, expected a program in Structured Text")
    if len(files) > MOST_FILES:
        raise StructuredTextError(f"{named[0]}: found {len(files)} files, expected at most {MOST_FILES}")
    return sorted(files)


def _everything(folder: Path) -> Iterator[Path]:
    """Yield what a folder and its subfolders contain. Raise StructuredTextError for more than MOST_ENTRIES."""
    for number, path in enumerate(folder.rglob("*")):
        if number == MOST_ENTRIES:
            raise StructuredTextError(f"{folder}: found more than {MOST_ENTRIES} files, expected a folder of a program")
        yield path


def read_texts(paths: Paths) -> list[Text]:
    """Return the texts of a program's files. Raise StructuredTextError for one that can't be read."""
    texts, left = [], MOST_BYTES
    for path in paths_of(paths):
        refused_file(path)
        try:
            data = read_file(path, left)
        except FileError as error:
            raise StructuredTextError(f"{path}: {error}, expected a program in Structured Text") from error
        left -= len(data)
        texts.append(Text(str(path), _decoded(path, data)))
    return texts


def _decoded(path: Path, data: bytes) -> str:
    """Return a text in UTF-8, or else with one byte for each character, as older tools write it."""
    if data.startswith(_UTF_16):
        raise StructuredTextError(f"{path}: is UTF-16, expected UTF-8 or Windows-1252")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def digest(texts: Sequence[Text], dialect: Dialect) -> str:
    """Return the SHA-256 of the texts, in any order, and of the dialect unless it is IEC 61131-3."""
    whole = "\0".join(sorted(one.text for one in texts))
    return hashlib.sha256((whole if dialect == IEC else f"{dialect.name}\0{whole}").encode()).hexdigest()


def joined(texts: Sequence[Text], dialect: Dialect) -> tuple[tree.SourceFile, ProgramFiles]:
    """Return the tree of all texts. Raise StructuredTextError for a text that can't be parsed."""
    starts = [1]
    for one in texts[:-1]:
        starts.append(starts[-1] + one.text.count("\n") + 1)
    files = ProgramFiles(tuple(one.file for one in texts), tuple(starts))
    parts: list[tuple[PurePath, tree.SourceFile]] = []
    try:
        for one, first in zip(texts, starts, strict=True):
            path = PurePath(one.file)
            text = "\n" * (first - 1) + one.text
            parts.append((path, parse(scl.plain(text) if dialect.tia_sources else text, dialect)))
        source = with_instances(br.joined(parts), dialect)
        scl.require_tasks(source, dialect)
        return source, files
    except SourceError as error:
        raise files.error(error) from None

# SPDX-License-Identifier: Apache-2.0
"""Units of the repositories: each object of a library with the objects that it needs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

_SKIPPED = re.compile(r"""\(\*.*?\*\)|//[^\n]*|/\*.*?\*/|'(?:[^'$\n]|\$.)*'|"(?:[^"$\n]|\$.)*\"""", re.DOTALL)
_DECLARED = re.compile(r"\b(?:FUNCTION_BLOCK|FUNCTION|PROGRAM|INTERFACE)\s+(?:ABSTRACT\s+|FINAL\s+)?\"?(\w+)", re.I)
_TYPE = re.compile(r"\bTYPE\b(.*?)\bEND_TYPE\b", re.I | re.DOTALL)
_TYPE_NAME = re.compile(r"(?:\A|;|END_STRUCT)\s*\"?(\w+)\"?\s*:(?!=)", re.I)
_GLOBALS = re.compile(r"\bVAR_GLOBAL\b(.*?)\bEND_VAR\b", re.I | re.DOTALL)
_ALL = re.compile(r"\bVAR\b(.*?)\bEND_VAR\b", re.I | re.DOTALL)
_VARIABLE = re.compile(r"(?:\A|;|CONSTANT|RETAIN|PERSISTENT)\s*([\w\s,]+?)\s*(?:AT\s*%[\w.*]+\s*)?:(?!=)", re.I)
_WORD = re.compile(r"(?a:[a-z_]\w*)", re.I)
_POINTER = re.compile(r"\bPOINTER\s+TO\b|\bREF(?:ERENCE_TO|ERENCE\s+TO|_TO)\b|\bADR\s*\(|\^|\bPT\s*:\s*POINTER\b", re.I)


@dataclass(frozen=True)
class Part:
    """File, or object of a file, with names that it declares and uses."""

    name: str
    text: str

    @cached_property
    def code(self) -> str:
        """Text without comments and literals, in small letters."""
        return _SKIPPED.sub(" ", self.text).lower()

    @cached_property
    def declares(self) -> frozenset[str]:
        """Names of units, types and global variables."""
        names = set(_DECLARED.findall(self.code))
        for inside in _TYPE.findall(self.code):
            names |= set(_TYPE_NAME.findall(inside))
        sections = _ALL if self.name.lower().endswith(".var") else _GLOBALS
        for inside in sections.findall(self.code):
            names |= {name for names in _VARIABLE.findall(inside) for name in names.replace(",", " ").split()}
        return frozenset(names)

    @cached_property
    def words(self) -> frozenset[str]:
        """Words of the text."""
        return frozenset(_WORD.findall(self.code))

    @property
    def points(self) -> bool:
        """True if the text uses pointers or references."""
        return _POINTER.search(self.code) is not None


@dataclass(frozen=True)
class Check:
    """Expected value of a variable of the program `main`, or of a global one, after one scan.

    variable: its name, or its number in the order of declarations. value: as the other compiler stores it: times in
    units of `unit` ns.
    """

    variable: str | int
    value: float | bool
    tolerance: float = 0.0
    name: str = ""
    """Name that goes before the number, if the program has a variable of that name."""


@dataclass(frozen=True)
class Unit:
    """Object that is compiled together with the objects that it needs."""

    name: str
    parts: tuple[Part, ...]
    """The object first."""
    checks: tuple[Check, ...] = ()
    """Expected values; without any, compiling is the test."""
    times: tuple[int, ...] = (0,)
    """Times of the scans, ns."""
    unit: float = 1.0
    """Unit of numbers that stand for durations, ns."""
    before: int = 0
    """Variables of the other compiler that are numbered before all others."""

    @property
    def group(self) -> str:
        """`points` for an object with pointers, `needs pointers` for one that needs such an object, else ""."""
        if self.parts[0].points:
            return "points"
        return "needs pointers" if any(part.points for part in self.parts[1:]) else ""


def with_needs(parts: Sequence[Part]) -> Iterator[Unit]:
    """Yield each part with those that it needs, directly or through others."""
    owner = _owners(parts)
    for part in parts:
        yield Unit(part.name, _reached([part], owner))


def reached(own: Sequence[Part], others: Sequence[Part]) -> tuple[Part, ...]:
    """Return parts with those of the others that they need, directly or through others."""
    return _reached(own, _owners(others))


def _owners(parts: Iterable[Part]) -> dict[str, list[Part]]:
    owner: dict[str, list[Part]] = {}
    for part in parts:
        for name in part.declares:
            owner.setdefault(name, []).append(part)
    return owner


def _reached(own: Sequence[Part], owner: dict[str, list[Part]]) -> tuple[Part, ...]:
    reached = {part.name: part for part in own}
    waiting = list(own)
    while waiting:
        part = waiting.pop()
        for name in sorted(part.words & owner.keys()):
            for other in owner[name]:
                if other.name not in reached:
                    reached[other.name] = other
                    waiting.append(other)
    return tuple(reached.values())


def files(folder: Path, suffixes: Iterable[str]) -> list[Part]:
    """Return the files of a folder with some suffixes, in order of their names."""
    known = {one.lower() for one in suffixes}
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in known and path.is_file())
    return [Part(str(path.relative_to(folder)), decoded(path)) for path in paths]


def decoded(path: Path) -> str:
    """Return the text of a file in UTF-8, or with one byte for each character."""
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")

# SPDX-License-Identifier: Apache-2.0
"""Sources of Siemens TIA Portal (SCL): marks of names, headers and regions, written as IEC 61131-3 has them.

Source: help of TIA Portal V18, "Generating blocks from external source files" and "SCL". Every character keeps its
line, and every name its column.
"""

from __future__ import annotations

import re

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.mistakes import place_of

_PART = re.compile(
    r"""(?P<keep>\(\*.*?\*\)|//[^\n]*|'(?:[^'$\n]|\$.)*'|\{[^}]*\})
       |(?P<comment>\(/\*.*?\*/\))
       |(?P<block>/\*.*?\*/)
       |(?P<name>\#?"(?P<quoted>[^"\n]*)")
       |(?P<local>(?<!\w)\#(?=[a-z_]))  # not of 16#FF
       |(?P<word>(?a:[a-z_]\w*))(?P<prefix>\#?)""",
    re.IGNORECASE | re.DOTALL | re.VERBOSE,
)
_UNITS = ("FUNCTION", "FUNCTION_BLOCK", "ORGANIZATION_BLOCK", "DATA_BLOCK", "TYPE")
_HEADER = re.compile(r"[ \t]*[:=][^\n]*")
_VOID = re.compile(r"(?<!\w):\s*void\b", re.IGNORECASE)
_RENAMED = {"ORGANIZATION_BLOCK": "PROGRAM", "END_ORGANIZATION_BLOCK": "END_PROGRAM"}
_NOT_CYCLIC = re.compile(r"OB(?!1\Z)\d+|startup|cyclic_interrupt\w*", re.IGNORECASE)


def plain(text: str) -> str:
    """Return a source without its marks. Raise SourceError."""
    return _Reader(text).read()


def require_tasks(source: tree.SourceFile, dialect: Dialect) -> None:
    """Require a CONFIGURATION if an organization block is a start-up, an interrupt or an error by its name.

    Raise SourceError without one.
    """
    for unit in source.units if dialect.tia_sources and not source.configurations else ():
        if unit.kind == "PROGRAM" and _NOT_CYCLIC.fullmatch(unit.name):
            expected = "OB1, Main, or a CONFIGURATION with its TASK"
            raise SourceError(unit.at, f"found {unit.name}, which is not cyclic, expected {expected}")


class _Reader:
    def __init__(self, text: str) -> None:
        self._text = text
        self._made = list(text)
        self._header = ""
        """Keyword of the unit whose header is being read; "" outside of headers."""
        self._unit = ""
        self._name_end = 0
        """Index of the last character of the unit's name."""
        self._colon = False
        """True if the header of a TYPE has kept a colon."""

    def read(self) -> str:
        """Return the text without marks."""
        place = 0
        while (match := _PART.search(self._text, place)) is not None:
            place = match.end()
            if match["comment"]:
                self._blank(match.start(), match.end())
            elif match["name"] is not None:
                self._name(match)
            elif match["local"]:
                self._blank(match.start(), match.end())
            elif match["word"] and not match["prefix"]:
                place = self._word(match)
        return "".join(self._made)

    def _name(self, match: re.Match[str]) -> None:
        """Replace quotation marks by blanks, and characters that no name in IEC 61131-3 has by underscores."""
        if not match["quoted"].strip():
            raise SourceError(place_of(self._text, match.start()), "found an empty name, expected one")
        name = re.sub(r"\W", "_", match["quoted"], flags=re.ASCII)
        start, end = match.span("quoted")
        self._made[start:end] = name
        self._made[end] = " "
        self._blank(match.start(), start)
        if name[0].isdigit():
            self._made[start - 1] = "_"
        if self._header and not self._name_end:
            self._name_end = end

    def _word(self, match: re.Match[str]) -> int:
        """Process a word. Return the index where the text goes on."""
        word, start, end = match["word"].upper(), match.start(), match.end()
        if word == "REGION":
            end = self._line_end(end)
            self._blank(start, end)
        elif word in ("END_REGION", "KNOW_HOW_PROTECT"):
            self._blank(start, end)
        elif word in _UNITS:
            self._header = self._unit = word
            self._name_end, self._colon = 0, False
        elif word.startswith("VAR") or word in ("BEGIN", "STRUCT"):
            self._end_of_header(start)
            if word == "BEGIN" and self._unit != "DATA_BLOCK":
                self._blank(start, end)
        elif self._header and self._name_end and (rest := _HEADER.match(self._text, end)):
            end = self._header_line(word, start, rest)
        if word in _RENAMED:
            self._made[start:end] = _RENAMED[word].ljust(end - start)
        return end

    def _header_line(self, word: str, start: int, rest: re.Match[str]) -> int:
        """Leave out VERSION, TITLE, AUTHOR, FAMILY and NAME of a header, with their values."""
        if word not in ("VERSION", "TITLE", "AUTHOR", "FAMILY", "NAME"):
            return rest.start()
        self._blank(start, rest.end())
        if self._header == "TYPE" and not self._colon:
            self._made[start] = ":"
            self._colon = True
        return rest.end()

    def _end_of_header(self, start: int) -> None:
        if self._header == "TYPE" and not self._colon and self._name_end:
            self._made[self._name_end] = ":"
        elif self._header == "FUNCTION" and (void := _VOID.search(self._text, self._name_end, start)):
            self._blank(*void.span())
        self._header = ""

    def _line_end(self, start: int) -> int:
        end = self._text.find("\n", start)
        return len(self._text) if end < 0 else end

    def _blank(self, start: int, end: int) -> None:
        self._made[start:end] = re.sub(r"[^\n]", " ", self._text[start:end])

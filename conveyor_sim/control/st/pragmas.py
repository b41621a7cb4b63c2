# SPDX-License-Identifier: Apache-2.0
"""Conditional pragmas: selects one branch of each {IF ...} before the text is parsed.

Supported pragmas of CODESYS ("Conditional Pragmas") and TwinCAT: {define name}, {define name 'text'}, {undefine name},
{IF}, {ELSIF}, {ELSE}, {END_IF}. Supported in conditions: defined (name), hasvalue (name, 'text'), NOT, AND, OR and
parentheses. {error 'text'} in a selected branch is an error. Conditional pragmas may stand anywhere between words, in
declarations too, and may be nested.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn

from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.mistakes import place_of

LONGEST = 1000
"""Largest number of characters in a condition."""

DEEPEST = 60
"""Largest depth of nested {IF ...}, and of parentheses in a condition."""

_ANY = re.compile(r"\{\s*#?\s*(if|els|end_?if|define|undef|error)", re.IGNORECASE)
_PART = re.compile(
    r"""\(\*|//[^\n]*|/\*.*?(?:\*/|\Z)|'(?:[^'$\n]|\$.)*'?|"(?:[^"$\n]|\$.)*"?|\{[^}]*(?:\}|\Z)|(?a:[a-z_]\w*)""",
    re.IGNORECASE | re.DOTALL,
)
_BRACKETS = re.compile(r"\(\*|\*\)")
_WORD = re.compile(r"\{\s*(#?\s*(?:if|ifn?def|els\w*|end_?if|define|undef\w*|error)(?!\w))", re.IGNORECASE)
_TOKEN = re.compile(r"\s*(?:([a-z_]\w*)|('(?:[^'$]|\$.)*')|([(),])|(\S))", re.IGNORECASE | re.DOTALL | re.ASCII)
_NAME = re.compile(r"(?a:[a-z_]\w*)", re.IGNORECASE)
_DEFINITION = re.compile(r"(?a:([a-z_]\w*))(?:\s+('(?:[^'$]|\$.)*'))?", re.IGNORECASE | re.DOTALL)
_OF_THE_TARGET = ("issimulationmode", "islittleendian", "isfpusupported")
_UNITS = ("PROGRAM", "FUNCTION", "FUNCTION_BLOCK")


@dataclass
class _If:
    """An open {IF ...}. taken: one of its branches was selected. remains: the present branch is selected."""

    at: int
    outside: bool
    """True if the text around it is selected."""
    taken: bool
    remains: bool
    otherwise: bool = False
    """True after its {ELSE}."""


def selected(text: str) -> str:
    """Return a text with blanks in place of conditional pragmas and of unselected branches.

    Every other character keeps its line and column. Raise SourceError.
    """
    return _Reader(text).read() if _ANY.search(text) else text


class _Reader:
    def __init__(self, text: str) -> None:
        self._text = text
        self.defined: dict[str, str] = {}
        """Text by defined name, "" without one. Case matters."""
        self._before: dict[str, str] | None = None
        """Inside a unit: definitions outside it, which apply again after its end."""
        self._configured = False
        self._open: list[_If] = []
        self._left_out: list[tuple[int, int]] = []

    def read(self) -> str:
        """Return the text that remains."""
        place = left_from = 0
        while (match := _PART.search(self._text, place)) is not None:
            place = self._end_of_comment(match.start()) if match.group() == "(*" else match.end()
            part = match.group()
            if part.endswith("}") and (word := _WORD.match(part)):
                remained = self._remains()
                self._pragma(match.start(), word[1].upper(), part[word.end() : -1].strip())
                if remained:
                    self._left_out.append((match.start(), place))
                if remained and not self._remains():
                    left_from = place
                elif not remained and self._remains():
                    self._left_out.append((left_from, place))
            elif self._remains() and _NAME.fullmatch(part):
                self._word(match.start(), part)
        if self._open:
            self.refuse(self._open[-1].at, "found {IF} without its end, expected {END_IF}")
        return self._blanked()

    def _remains(self) -> bool:
        return not self._open or (self._open[-1].outside and self._open[-1].remains)

    def _end_of_comment(self, start: int) -> int:
        depth = 0
        for match in _BRACKETS.finditer(self._text, start):
            depth += 1 if match.group() == "(*" else -1
            if depth == 0:
                return match.end()
        return len(self._text)

    def _blanked(self) -> str:
        pieces, place = [], 0
        for start, end in self._left_out:
            pieces += [self._text[place:start], re.sub(r"[^\n]", " ", self._text[start:end])]
            place = end
        return "".join([*pieces, self._text[place:]])

    def _word(self, start: int, name: str) -> None:
        """Process a word of a selected part. Each unit has separate definitions, and texts do not replace names."""
        upper = name.upper()
        if upper in ("CONFIGURATION", "END_CONFIGURATION"):
            self._configured = upper == "CONFIGURATION"
        elif upper in _UNITS and not self._configured and self._before is None:
            self._before = dict(self.defined)
        elif upper.removeprefix("END_") in _UNITS and upper not in _UNITS and self._before is not None:
            self.defined, self._before = self._before, None
        if self.defined.get(name):
            self.refuse(start, f"found {name}, expected another name: {{define}} does not replace it by its text")

    def _pragma(self, at: int, word: str, rest: str) -> None:
        if word == "IF":
            if len(self._open) == DEEPEST:
                self.refuse(at, f"found {{IF}} more than {DEEPEST} deep, expected fewer")
            outside = self._remains()
            yes = outside and self._condition(at, rest)
            self._open.append(_If(at, outside, yes, yes))
        elif word in ("ELSIF", "ELSE", "END_IF"):
            self._branch(at, word, rest)
        elif not self._remains():
            return
        elif word == "ERROR":
            self.refuse(at, f"found {{error {rest}}}, expected another branch of {{IF}}")
        elif word == "DEFINE" and (match := _DEFINITION.fullmatch(rest)):
            self.known(at, match[1])
            self.defined[match[1]] = match[2] or ""
        elif word == "UNDEFINE" and _NAME.fullmatch(rest):
            self.known(at, rest)
            self.defined.pop(rest, None)
        else:
            shown = f"{{{word} {rest}".strip()[:60]
            expected = "{define name}, {define name 'text'}, {undefine name}, {IF}, {ELSIF}, {ELSE} or {END_IF}"
            self.refuse(at, f"found {shown}}}, expected {expected}")

    def _branch(self, at: int, word: str, rest: str) -> None:
        if not self._open:
            self.refuse(at, f"found {{{word}}} without {{IF}}, expected {{IF}} before")
        one = self._open[-1]
        if word != "ELSIF" and rest:
            self.refuse(at, f"found {{{word} {rest[:40]}}}, expected {{{word}}}")
        if word == "END_IF":
            self._open.pop()
            return
        if one.otherwise:
            self.refuse(at, f"found {{{word}}} after {{ELSE}}, expected {{END_IF}}")
        one.otherwise = word == "ELSE"
        wanted = one.outside and not one.taken
        one.remains = wanted and (word == "ELSE" or self._condition(at, rest))
        one.taken = one.taken or one.remains

    def _condition(self, at: int, text: str) -> bool:
        return _Condition(self, at, text).whole()

    def known(self, at: int, name: str) -> str:
        """Return the name, unless it differs from a defined one in capitals only."""
        other = next((one for one in self.defined if one.lower() == name.lower() and one != name), None)
        if other is not None:
            self.refuse(at, f"found {name}, expected {other}, as in {{define}}")
        if name.lower() in _OF_THE_TARGET:
            self.refuse(at, f"found {name}, expected a name of a {{define}}, because there is no target")
        return name

    def refuse(self, at: int, words: str) -> NoReturn:
        """Raise SourceError at a character of the text."""
        raise SourceError(place_of(self._text, at), words)


class _Condition:
    """Condition with the precedence of NOT, AND, OR."""

    def __init__(self, reader: _Reader, at: int, text: str) -> None:
        self._reader, self._at, self._text = reader, at, text
        if len(text) > LONGEST:
            reader.refuse(at, f"found a condition of {len(text)} characters, expected at most {LONGEST}")
        self._tokens = [match[0].strip() for match in _TOKEN.finditer(text)]
        self._place = 0
        self._depth = 0

    def whole(self) -> bool:
        """Return the value. Raise SourceError for a condition that is not supported."""
        value = self._any()
        if self._place < len(self._tokens):
            self._unexpected()
        return value

    def _any(self) -> bool:
        value = self._all()
        while self._next("OR"):
            value = self._all() or value
        return value

    def _all(self) -> bool:
        value = self._one()
        while self._next("AND"):
            value = self._one() and value
        return value

    def _one(self) -> bool:
        self._depth += 1
        if self._depth > DEEPEST:
            self._reader.refuse(self._at, f"found a condition more than {DEEPEST} deep, expected a flatter one")
        if self._next("NOT"):
            value = not self._one()
        elif self._next("("):
            value = self._any()
            self._need(")")
        elif self._next("DEFINED"):
            self._need("(")
            value = self._name() in self._reader.defined
            self._need(")")
        elif self._next("HASVALUE"):
            value = self._has_value()
        else:
            self._unexpected()
        self._depth -= 1
        return value

    def _has_value(self) -> bool:
        self._need("(")
        name = self._name()
        self._need(",")
        text = self._tokens[self._place] if self._place < len(self._tokens) else ""
        if not text.startswith("'") or len(text) < 2:
            self._unexpected()
        self._place += 1
        self._need(")")
        return self._reader.defined.get(name) == text

    def _name(self) -> str:
        name = self._tokens[self._place] if self._place < len(self._tokens) else ""
        if not _NAME.fullmatch(name):
            self._unexpected()
        self._place += 1
        return self._reader.known(self._at, name)

    def _next(self, word: str) -> bool:
        matches = self._place < len(self._tokens) and self._tokens[self._place].upper() == word
        self._place += matches
        return matches

    def _need(self, word: str) -> None:
        if not self._next(word):
            self._unexpected()

    def _unexpected(self) -> NoReturn:
        words = "expected defined (name) and hasvalue (name, 'text'), with NOT, AND, OR and parentheses"
        token = self._tokens[self._place] if self._place < len(self._tokens) else "its end"
        self._reader.refuse(self._at, f"found {token} in the condition {self._text[:60]!r}, {words}")

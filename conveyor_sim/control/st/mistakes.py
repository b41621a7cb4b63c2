# SPDX-License-Identifier: Apache-2.0
"""Messages for texts that can't be parsed: text found, and text expected, in words of the language."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from lark import Token

from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.foreign import ASSIGN, form_at

REFUSED: Mapping[str, str] = {
    **dict.fromkeys(("END_STEP", "END_TRANSITION"), "SFC"),
    **dict.fromkeys(("VAR_ACCESS", "VAR_CONFIG"), "access paths and VAR_CONFIG"),
    "VAR_INST": "VAR_INST, which belongs to methods; VAR of a block keeps its values",
}
"""Words of the standard and of dialects that this interpreter does not support, with the feature they belong to."""

SUSPECT: Mapping[str, str] = {
    **dict.fromkeys(("POINTER", "REFERENCE", "REF_TO", "REF", "ADR"), "pointers and references"),
    **dict.fromkeys(("CLASS", "INTERFACE", "EXTENDS", "IMPLEMENTS", "NAMESPACE"), "classes, methods and namespaces"),
    **dict.fromkeys(("METHOD", "PROPERTY", "THIS", "SUPER", "USING"), "classes, methods and namespaces"),
    **dict.fromkeys(("PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL"), "access specifiers"),
    **dict.fromkeys(("INITIAL_STEP", "STEP", "TRANSITION", "ACTION"), "SFC"),
    **dict.fromkeys(("JMP", "GOTO"), "jumps"),
    **dict.fromkeys(("UNION",), "unions"),
    **dict.fromkeys(("R_EDGE", "F_EDGE"), "R_EDGE and F_EDGE, which R_TRIG and F_TRIG do"),
}
"""Such words that may also be names. They are refused only where the text makes no sense otherwise."""

_WORDS = {
    "NAME": "a name",
    "PREFIX": "a value with its type",
    "INTEGER": "a whole number",
    "BASED": "a number such as 16#FF",
    "DECIMAL": "a number such as 1.5",
    "TIME": "a duration such as T#1s",
    "MOMENT": "a date or time of day",
    "TEXT": "a text",
    "WIDE_TEXT": "a text",
    "ADDRESS": "an address such as %IX0.0",
    "PARTIAL": "a part such as %X0",
    "SECTION": "VAR",
    "QUALIFIER": "CONSTANT, RETAIN or another qualifier",
    "TAG": "{tag: ...}",
    "$END": "the end of the file",
}
"""Tokens in words of the language, except those that have only one text."""
_WORD = re.compile(r"\w+")
_COMMENT = re.compile(r"\(\*|\*\)")
_STATEMENTS = {"IF", "CASE", "FOR", "WHILE", "REPEAT", "EXIT", "CONTINUE", "RETURN"}
_OPERATORS = {
    *("OR", "OR_ELSE", "XOR", "AND", "AMPERSAND", "AND_THEN", "MOD", "EQUALS", "DIFFERS", "LESS", "GREATER"),
    *("AT_MOST", "AT_LEAST", "PLUS", "MINUS", "TIMES", "OVER", "POWER"),
}
_VALUES = {
    *("INTEGER", "BASED", "DECIMAL", "TIME", "MOMENT", "TEXT", "WIDE_TEXT", "TRUE", "FALSE", "PREFIX", "NOT", "PLUS"),
    *("MINUS", "NAME", "LPAR"),
}


def at_of(token: Token) -> Position:
    """Return the position of a token."""
    return Position(token.line or 1, token.column or 1)


def place_of(text: str, index: int) -> Position:
    """Return line and column of a character."""
    return Position(text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index))


def not_refused(token: Token) -> Token:
    """Return a name or a prefix of #. Raise SourceError for a word of an unsupported feature."""
    if what := REFUSED.get(token.value.upper()):
        raise SourceError(at_of(token), f"found {token.value}, expected a program without {what}")
    return token


def word_of(name: str, terminals: Mapping[str, str]) -> str:
    """Return a token in words of the language."""
    if name in _WORDS:
        return _WORDS[name]
    shown = terminals[name]
    return shown.upper() if shown.isidentifier() else f"'{shown}'"


def _last_else_if(text: str, place: int) -> int | None:
    """Return the index of the last ELSE IF before a place."""
    matches = list(re.finditer(r"\bELSE[ \t]+IF\b", text[:place], re.IGNORECASE))
    return matches[-1].start() if matches else None


def _ends(text: str, place: int) -> bool:
    """Return True if a comment ends, with all comments in it."""
    depth = 0
    for match in _COMMENT.finditer(text, place):
        depth += 1 if match.group() == "(*" else -1
        if depth == 0:
            return True
    return False


def unexpected_character(error: Any, text: str, terminals: Mapping[str, str]) -> SourceError:
    """Return the error for lark's UnexpectedCharacters.

    terminals: as for `unexpected`.
    """
    place = error.pos_in_stream
    if (form := form_at(text, place, _accepted(set(error.allowed or ()), terminals))) is not None:
        return SourceError(place_of(text, form[0]), form[1])
    return SourceError(place_of(text, place), f"found {text[place]!r}, expected Structured Text")


def _accepted(names: set[str], terminals: Mapping[str, str]) -> set[str]:
    """Return names of tokens, where := has the name ASSIGN."""
    return names | {ASSIGN for name in names if terminals.get(name) == ":="}


def unexpected(error: Any, text: str, terminals: Mapping[str, str]) -> SourceError:
    """Return the error for lark's UnexpectedToken.

    terminals: texts of the tokens that have only one, by name.
    """
    token = error.token
    place = len(text) if token.type == "$END" else error.pos_in_stream
    expected = set(error.accepts or error.expected) - {"ACTION"}
    if (form := form_at(text, place, _accepted(expected, terminals))) is not None:
        return SourceError(place_of(text, form[0]), form[1])
    for match in (*list(_WORD.finditer(text, 0, place))[-1:], *_WORD.finditer(text, place, place + len(token.value))):
        if what := SUSPECT.get(match.group().upper()):
            return SourceError(
                place_of(text, match.start()), f"found {match.group()}, expected a program without {what}"
            )
    if text.startswith("(*", place):
        if _ends(text, place):
            return SourceError(at_of(token), "found comments nested three deep, expected at most two levels")
        return SourceError(at_of(token), "found a comment that does not end, expected *)")
    if token.type == "ADDRESS":
        return SourceError(at_of(token), f"found {token}, expected a variable that is declared AT {token}")
    found = "the end of the file" if token.type == "$END" else f"'{token.value}'"
    if "END_IF" in expected and (other := _last_else_if(text, place)) is not None:
        return SourceError(place_of(text, other), "found ELSE IF, which opens another IF, expected ELSIF or END_IF")
    words = []
    if expected >= _STATEMENTS:
        expected -= _STATEMENTS | {"NAME", "PREFIX", "SEMICOLON"}
        words.append("a statement")
    if expected >= _VALUES:
        expected -= {*_VALUES, "AND", "OR", "XOR", "MOD"}  # their calls as functions
        words.append("a value")
    if expected >= _OPERATORS:
        expected -= _OPERATORS
        words.append("an operator")
    words += sorted({word_of(name, terminals) for name in expected})
    listed = words[0] if len(words) == 1 else f"one of {', '.join(words)}"
    return SourceError(at_of(token), f"found {found}, expected {listed}")

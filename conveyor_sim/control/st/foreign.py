# SPDX-License-Identifier: Apache-2.0
"""Foreign forms: files, words and signs of other languages and dialects, each with the form to use here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import NamedTuple

from conveyor_sim.control.st.errors import StructuredTextError

FILES: Mapping[str, str] = {
    **dict.fromkeys(
        (".tcpou", ".tcdut", ".tcgvl", ".tcio"), "XML of TwinCAT; copy declaration and body into a .st file"
    ),
    ".xml": "PLCopen XML or another XML; export the units as text",
    **dict.fromkeys((".awl", ".il"), "an instruction list (AWL, IL); write it as Structured Text"),
    **dict.fromkeys((".project", ".library", ".pro", ".lib"), "a project of CODESYS; export the units as text"),
    **dict.fromkeys((".zap16", ".zap17", ".zap18", ".zap19"), "an archive of TIA Portal; generate sources (.scl)"),
}
"""Forms of files that are refused, by file type, with the way to text."""

_NO_EXCEPTIONS = "a program without __TRY and __CATCH; check values before they are used"
_NO_POINTERS = "a program without pointers and references; VAR_IN_OUT passes a variable"
_NO_OBJECTS = "a program without classes and methods; a FUNCTION_BLOCK has one body"
_NO_LIST = "Structured Text, no instruction list"
_TIA = "dialect tia, the default of .scl"

WORDS: Mapping[str, str] = {
    **dict.fromkeys(("ELSEIF", "ELIF"), "ELSIF"),
    **{f"END{word}": f"END_{word}" for word in ("IF", "CASE", "FOR", "WHILE", "REPEAT", "VAR", "STRUCT", "TYPE")},
    **{f"END{word}": f"END_{word}" for word in ("FUNCTION", "PROGRAM", "FUNCTIONBLOCK")},
    "NEXT": "END_FOR",
    "WEND": "END_WHILE",
    "DEFAULT": "ELSE for all other values of a CASE",
    "SWITCH": "CASE x OF",
    "BREAK": "EXIT",
    **dict.fromkeys(("__TRY", "__CATCH", "__FINALLY", "__ENDTRY"), _NO_EXCEPTIONS),
    **dict.fromkeys(
        ("__NEW", "__DELETE", "__ISVALIDREF", "__QUERYPOINTER", "ADR", "BITADR", "MEMSET", "MEMCPY", "MEMMOVE"),
        _NO_POINTERS,
    ),
    **dict.fromkeys(("NULL", "NIL", "ACCESS"), _NO_POINTERS),
    **dict.fromkeys(("__QUERYINTERFACE", "ABSTRACT", "OVERRIDE"), _NO_OBJECTS),
    **dict.fromkeys(("REGION", "END_REGION", "BEGIN", "ORGANIZATION_BLOCK", "DATA_BLOCK", "VERSION"), _TIA),
    "NETWORK": _NO_LIST,
    "EDGEPOS": "an instance of R_TRIG, called in every scan",
    "EDGENEG": "an instance of F_TRIG, called in every scan",
    **dict.fromkeys(("EDGE", "RESET_TIMER", "PRESET_TIMER"), "a call of a block: no such function is supported"),
    **dict.fromkeys(("PEEK", "POKE", "MOVE_BLK", "MOVE_BLK_VARIANT", "FILL_BLK", "BLKMOV"), "an assignment, or a FOR"),
    **dict.fromkeys(("VARIANT", "ANY", "ANY_NUM", "ANY_INT", "ANY_REAL", "ANY_BIT"), "a type that is known"),
    **dict.fromkeys(("S5TIME", "TIMER", "COUNTER"), "TIME with TON, TOF or TP, and CTU, CTD or CTUD"),
}
"""Forms to use, by words that are names in Structured Text, in capitals."""

_NAMES = (
    "NEXT",
    "DEFAULT",
    "BREAK",
    "SWITCH",
    "BEGIN",
    "VERSION",
    "REGION",
    "NETWORK",
    "EDGE",
    "TIMER",
    "COUNTER",
    "ANY",
)
"""Such words that variables often have as names."""

_LIST = re.compile(
    r"[ \t]*(?:\w+[ \t]*:)?[ \t]*(?:LDN?|STN?|CALC?N?|JMPC?N?|RETC?N?|ANDN?|ORN?|XORN?"
    r"|ADD|SUB|MUL|DIV|GT|GE|EQ|NE|LE|LT"
    r"|[SRLTAOUX=]|AN|ON|UN|XN|FP|FN)[ \t]+[\w.\"%#]+(?:[ \t]+[\d.]+)?[ \t]*(?://[^\n]*|\(\*[^\n]*)?",
    re.IGNORECASE,
)
"""Line of an instruction list."""


class Form(NamedTuple):
    """Foreign form at a token that does not fit."""

    before: str
    """Pattern that the text before the token ends with; its group is named in the message."""
    at: str
    """Pattern at the token, which the message shows with the text from the group on; "": the group alone."""
    expected: str
    """Form to use."""
    accepts: str = ""
    """Token that must fit there, "" for any."""


ASSIGN = "ASSIGN"
"""The sign := among the tokens that fit."""

_CALLS = r"\bFUNCTION(?:_BLOCK)?[ \t]+\w+[ \t]*"
_C_TYPES = "BOOL|S?INT|U?INT|[UL]?DINT|U?LINT|L?REAL|STRING|TIME|BYTE|WORD|DWORD|float|double|bool|char"

FORMS: tuple[Form, ...] = (
    Form(r"(==?)\s*", r"=(?!=)", "'=' to compare, ':=' to assign"),
    Form(r"()", r"==", "'=' to compare, ':=' to assign"),
    Form(r"(=)", r"<", "'<='"),
    Form(r"()", r"=>", "'>='"),
    Form(r"()", r"=(?!=)", "':=' to assign", ASSIGN),
    Form(r"()", r":=", "'=' to compare, or one := in a statement", "EQUALS"),
    Form(r":\s*(\w+[ \t]*\()[^()]*", r",", "no arguments of FB_init; b : FB(IN := x) sets inputs by name", "RPAR"),
    Form(r"()", r"\+=", "x := x + y"),
    Form(r"()", r"-=", "x := x - y"),
    Form(r"()", r"\*=", "x := x * y"),
    Form(r"()", r"/=", "x := x / y"),
    Form(r"()", r"\+\+", "x := x + 1"),
    Form(r"()", r"--", "x := x - 1"),
    Form(r"(&)", r"&", "'AND'"),
    Form(r"()", r"!=", "'<>'"),
    Form(r"()", r"!", "'NOT'"),
    Form(r"()", r"\|\|?", "'OR'"),
    Form(r"()", r"%(?=[ \t\d(])", "'MOD'"),
    Form(r"()", r"%[A-Za-z][\w*.]*", "an address such as %IX0.0, or a part such as %X0", "PARTIAL"),
    Form(r"()", r"~", "'NOT'"),
    Form(r"()", r"\?", "SEL or IF"),
    Form(r"()", r"\^", _NO_POINTERS),
    Form(r"()", r"#[A-Za-z_]\w*", f"the name without #; {_TIA}, has it"),
    Form(r"()", r"\"[^\"\n]*\"", f"a name without quotation marks; {_TIA}, has them", "NAME"),
    Form(r"()", r"[\"'][^\n]{0,40}", "a text that ends in the same line, in its quotation marks"),
    Form(r"()", r"[Ss][ \t]*=(?!=)", "IF y THEN x := TRUE; END_IF", ASSIGN),
    Form(r"()", r"[Rr][ \t]*=(?!=)", "IF y THEN x := FALSE; END_IF", ASSIGN),
    Form(r"(" + _CALLS + r")", r"\(", "the inputs in VAR_INPUT ... END_VAR"),
    Form(r"(\bFUNCTION_BLOCK[ \t]+(?:ABSTRACT|FINAL|PUBLIC|INTERNAL))[ \t]+\w+\s+", r"", _NO_OBJECTS),
    Form(r"(\bFUNCTION[ \t]+BLOCK)[ \t]+\w+\s+", r"", "FUNCTION_BLOCK"),
    Form(rf"(\b(?:{_C_TYPES}))[ \t]+", r"[A-Za-z_]\w*", "the name first: x : INT;", "COLON"),
    Form(r"(\bARRAY)[ \t]*", r"\(", "ARRAY [1..9] OF and a type"),
    Form(r"(\bRETURN)[ \t]+", r"[^;\s]", "the name of the function := and its value, then RETURN;"),
)
"""Foreign forms, looked up in this order."""


def refused_file(path: PurePath) -> None:
    """Raise StructuredTextError for a file of a known type that is no text in Structured Text."""
    if (form := FILES.get(path.suffix.lower())) is not None:
        raise StructuredTextError(f"{path}:1:1: found {form}")


def advice(name: str) -> str:
    """Return the form to use in place of a foreign word; "" for another name."""
    return WORDS.get(name.upper(), "")


def form_at(text: str, place: int, accepts: set[str]) -> tuple[int, str] | None:
    """Return the index and the message of a foreign form at or before a token that does not fit, None without one.

    accepts: names of the tokens that fit.
    """
    if text.lstrip("\ufeff \t\r\n").startswith("<"):
        return text.index("<"), "found XML, expected Structured Text; export the units as text"
    for start, word in _words(text, place):
        if expected := advice(word):
            return start, f"found {word}, expected {expected}"
    for form in FORMS:
        at = re.compile(form.at, re.IGNORECASE).match(text, place)
        if at is None or (form.accepts and form.accepts not in accepts):
            continue
        begin = max(0, place - 80)
        before = re.search(f"{form.before}\\Z", text[begin:place], re.IGNORECASE)
        if before is not None:
            start = begin + before.start(1)
            shown = text[start : at.end()] if form.at else before[1]
            return start, f"found {shown}, expected {form.expected}"
    line = text.rfind("\n", 0, place) + 1
    if (listed := _LIST.match(text, line)) is not None and text[listed.end() : listed.end() + 1] in ("", "\n", "\r"):
        return line, f"found {listed.group().strip()}, expected {_NO_LIST}"
    return None


def _words(text: str, place: int) -> list[tuple[int, str]]:
    """Return the word before a place and the one that begins there, except names that do not begin their line."""
    begin = max(0, place - 80)
    before = re.search(r"\b(\w+)[^\w;]*\Z", text[begin:place])
    at = re.compile(r"\w+").match(text, place)
    words = [(begin + before.start(1), before[1])] if before is not None else []
    words += [(place, at.group())] if at is not None else []
    return [
        one
        for one in words
        if one[1].upper() not in _NAMES or not text[text.rfind("\n", 0, one[0]) + 1 : one[0]].strip()
    ]

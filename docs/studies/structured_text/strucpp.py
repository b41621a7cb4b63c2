# SPDX-License-Identifier: Apache-2.0
"""Tests of STruC++: TEST 'name' ... END_TEST with assertions, as programs that store each assertion in a variable."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from units import Check, Part, Unit, decoded

_TEST = re.compile(r"\bTEST\s+'((?:[^'$]|\$.)*)'(.*?)\bEND_TEST\b", re.DOTALL)
_ASSERT = re.compile(r"\bASSERT_(EQ|NEQ|TRUE|FALSE|NEAR|GT|LT|GE|LE)\s*\(")
_ADVANCE = re.compile(r"\bADVANCE_TIME\s*\(\s*T#(\d+)(ms|s)\s*\)\s*;", re.IGNORECASE)
_PROGRAM = re.compile(r"\b(END_)?PROGRAM\b", re.IGNORECASE)
_VAR = re.compile(r"\bVAR\b.*?\bEND_VAR\b", re.DOTALL)
_MS = {"ms": 1_000_000, "s": 1_000_000_000}


def units(folder: Path, chosen: str) -> Iterator[Unit]:
    """Yield the tests of the folder `oscat`, or of all others.

    chosen: `oscat` or `others`. Programs of the source are called as blocks, so they become blocks.
    """
    for path in sorted((folder / "tests" / "st-validation").rglob("test_*.st")):
        if (path.parent.name == "oscat") != (chosen == "oscat"):
            continue
        source = decoded(path.with_name(path.name.removeprefix("test_")))
        text = decoded(path)
        if re.search(r":\s*\w+", source) and _PROGRAM.search(source) and "CONFIGURATION" not in source.upper():
            source = _PROGRAM.sub(lambda match: f"{match[1] or ''}FUNCTION_BLOCK", source)
        for match in _TEST.finditer(text):
            made = _program(match[2])
            if made is not None:
                body, checks, times = made
                parts = (Part(f"{path.name}: {match[1]}", body), Part(path.name.removeprefix("test_"), source))
                yield Unit(parts[0].name, parts, checks, times)


def _program(body: str) -> tuple[str, tuple[Check, ...], tuple[int, ...]] | None:
    """Return the program of a test, its checks, and the times of its scans; None if it can't be one."""
    declared = "\n".join(_VAR.findall(body))
    rest = _VAR.sub(" ", body)
    if (converted := _asserted(rest)) is None:
        return None
    rest, count = converted
    steps, times, last = [], [0], 0
    for match in _ADVANCE.finditer(rest):
        steps.append(rest[last : match.start()])
        times.append(times[-1] + int(match[1]) * _MS[match[2].lower()])
        last = match.end()
    steps.append(rest[last:])
    cases = "\n".join(f"{number}: {text}\n;" for number, text in enumerate(steps))
    checked = "".join(f" test_ok_{number} : BOOL;" for number in range(count))
    run = f"CASE test_step OF {cases}\nEND_CASE; test_step := test_step + 1;" if len(steps) > 1 else steps[0]
    text = f"PROGRAM main {declared}\nVAR{checked} test_step : INT; END_VAR\n{run}\nEND_PROGRAM"
    return text, tuple(Check(f"main/test_ok_{number}", True) for number in range(count)), tuple(times)


def _asserted(text: str) -> tuple[str, int] | None:
    """Return a text with assertions as assignments, and their number; None for an assertion of another form."""
    made, place, count = [], 0, 0
    while (match := _ASSERT.search(text, place)) is not None:
        parts, end = _arguments(text, match.end())
        if (condition := _condition(match[1], parts)) is None:
            return None
        made += [text[place : match.start()], f"test_ok_{count} := {condition}"]
        place, count = end, count + 1
    return "".join([*made, text[place:]]), count


def _condition(kind: str, parts: list[str]) -> str | None:
    if kind in ("TRUE", "FALSE"):
        return f"({parts[0]}) = {kind}"
    if kind == "NEAR":
        return f"ABS(({parts[0]}) - ({parts[1]})) <= {parts[2]}" if len(parts) >= 3 else None
    operator = {"EQ": "=", "NEQ": "<>", "GT": ">", "LT": "<", "GE": ">=", "LE": "<="}[kind]
    return f"({parts[0]}) {operator} ({parts[1]})" if len(parts) >= 2 else None


def _arguments(text: str, start: int) -> tuple[list[str], int]:
    """Return the arguments after an opening parenthesis, and the index after the closing one."""
    parts, depth, place, quoted = [""], 0, start, False
    while place < len(text):
        char = text[place]
        quoted ^= char == "'"
        depth += 0 if quoted else (char in "([") - (char in ")]")
        if depth < 0:
            break
        if char == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += char
        place += 1
    return [part.strip() for part in parts], place + 1

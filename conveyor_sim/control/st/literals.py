# SPDX-License-Identifier: Apache-2.0
"""Values of literals: numbers in bases, durations as whole nanoseconds, characters escaped by $."""

from __future__ import annotations

import re

from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.types import MOST_CHARACTERS

_UNITS = {"d": 86_400_000_000_000, "h": 3_600_000_000_000, "m": 60_000_000_000, "s": 1_000_000_000}
_UNITS |= {"ms": 1_000_000, "us": 1_000, "ns": 1}
_ORDER = tuple(_UNITS)
_PART = re.compile(r"(\d+(?:\.\d+)?)(ms|us|ns|d|h|m|s)")
_LONGEST = 1000
"""Largest number of characters in a number: more than any type needs, and fewer than Python's limit."""
_ESCAPES = {"$": "$", "'": "'", '"': '"', "l": "\n", "n": "\n", "p": "\f", "r": "\r", "t": "\t"}


def integer(at: Position, text: str) -> int:
    """Return the value of 1_000."""
    _require_short(at, text)
    return int(text.replace("_", ""))


def based(at: Position, text: str) -> int:
    """Return the value of 16#FF, 8#17 or 2#1010_0001."""
    _require_short(at, text)
    base, _, digits = text.partition("#")
    try:
        return int(digits.replace("_", ""), int(base))
    except ValueError:
        raise SourceError(at, f"found {text}, expected digits of base {base}") from None


def real(text: str) -> float:
    """Return the value of 1.5, 2E3 or 1_000.25e-6."""
    return float(text.replace("_", ""))


def duration(at: Position, text: str) -> int:
    """Return T#1h30m, TIME#-2.5s or T#1d_4h in ns.

    Each unit may occur once, from the largest down; only the last may have decimals.
    """
    _require_short(at, text)
    written = text.partition("#")[2].lower().replace("_", "")
    sign, digits = (-1, written[1:]) if written.startswith("-") else (1, written.removeprefix("+"))
    parts = _PART.findall(digits)
    units = [_ORDER.index(unit) for _, unit in parts]
    whole = all("." not in number for number, _ in parts[:-1])
    if not (parts and "".join(map("".join, parts)) == digits and units == sorted(set(units)) and whole):
        raise SourceError(at, f"found {text}, expected a duration such as T#1m30s or T#2.5s")
    total = 0
    for number, unit in parts:
        before, _, after = number.partition(".")
        total += int(before) * _UNITS[unit]
        total += int(after or "0") * _UNITS[unit] // 10 ** len(after)
    if not -(2**63) <= sign * total < 2**63:
        raise SourceError(at, f"found {text}, expected a duration of at most 64 bits of ns, which is 292 years")
    return sign * total


def long_time_text(value: int) -> str:
    """Return a duration as a literal of LTIME: LTIME#1m30s."""
    return f"LTIME{time_text(value)[1:]}"


def time_text(value: int) -> str:
    """Return a duration as a literal of TIME: T#1m30s."""
    rest, parts = abs(value), ""
    for unit, size in _UNITS.items():
        count, rest = divmod(rest, size)
        parts += f"{count}{unit}" if count else ""
    return f"T#{'-' if value < 0 else ''}{parts or '0s'}"


def _require_short(at: Position, text: str) -> None:
    if len(text) > _LONGEST:
        raise SourceError(at, f"found a number of {len(text)} characters, expected at most {_LONGEST}")


def characters(at: Position, text: str, wide: bool) -> str:
    """Return the text between quotes.

    $$, $', $N, $0A (two digits; four in a wide text) stand for one character, and '' between single quotes for a quote.
    """
    digits = 4 if wide else 2
    body, read, index = text[1:-1], [], 0
    while index < len(body):
        char = body[index]
        if char == "'" and not wide:
            read.append(char)
            index += 2
        elif char != "$":
            if not wide and ord(char) > 255:
                raise SourceError(at, f"found {char!r} in a STRING, expected characters up to $FF; a WSTRING has all")
            read.append(char)
            index += 1
        elif (escape := _ESCAPES.get(body[index + 1].lower())) is not None:
            read.append(escape)
            index += 2
        else:
            code = body[index + 1 : index + 1 + digits]
            if not re.fullmatch(rf"[0-9A-Fa-f]{{{digits}}}", code):
                raise SourceError(
                    at, f"found ${code} in a text, expected $$, $', $L, $N, $P, $R, $T or ${'F' * digits}"
                )
            read.append(chr(int(code, 16)))
            index += 1 + digits
    if len(read) > MOST_CHARACTERS:
        raise SourceError(at, f"found a text of {len(read)} characters, expected at most {MOST_CHARACTERS}")
    return "".join(read)

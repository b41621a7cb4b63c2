# SPDX-License-Identifier: Apache-2.0
"""JSON files that a later command reads back: bounded, strict, and ended by a checksum over every byte before it.

A file ends in `"sha256": "<64 digits>"}`. The digits are the SHA-256 of all bytes in front of them. The checksum finds
damage; it is no signature. A file without it may come from an older version: its reader decides if that is accepted.
"""

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conveyor_sim.support.files import MB, FileError, in_mb, read_file

CHECKSUM = "sha256"
"""Name of the last field."""
MOST = 64 * MB
"""Bytes of a file that are read."""
DEEPEST = 32
"""Lists and mappings inside each other that are read."""
_HALF = re.compile(r"[\ud800-\udc7f\udd00-\udfff]")
"""Surrogates, except the ones in which Python stores bytes of paths that are not UTF-8."""
LARGEST = 10**300
"""Largest whole number that is read, so that each of them fits a float."""

_BEFORE, _DIGITS, _AFTER = f'"{CHECKSUM}": "'.encode(), 64, b'"}\n'


@dataclass(frozen=True)
class CheckedJson:
    """Content of a file."""

    data: dict[str, Any]
    """Fields without the checksum."""
    has_checksum: bool
    """True if a checksum was there and is right; False if there is none."""


def with_checksum(data: Mapping[str, Any], indent: int | None = None) -> bytes:
    """Return a mapping of at least one field as JSON with its checksum. It may hold NaN and Infinity."""
    text = json.dumps(dict(data), indent=indent)
    body = text[:-1].rstrip().encode() + (b", " if indent is None else b",\n ") + _BEFORE
    return body + hashlib.sha256(body).hexdigest().encode() + _AFTER


def read_checked(path: Path, most: int = MOST, finite: bool = True) -> CheckedJson:
    """Return the content of a file of at most `most` bytes.

    finite: refuse NaN and infinite numbers. Raises FileError, in words that follow the path, for a file that can't be
    read or is no JSON. The same holds for repeated fields, more than DEEPEST levels, and a wrong checksum.
    """
    content = read_file(path, most)
    place = len(content) - len(_AFTER) - _DIGITS
    has_checksum = place > 0 and content.endswith(_AFTER) and content[:place].endswith(_BEFORE)
    if has_checksum and hashlib.sha256(content[:place]).hexdigest().encode() != content[place : -len(_AFTER)]:
        raise FileError("its checksum does not fit")
    data = parsed(content, finite)
    if not isinstance(data, dict):
        raise FileError("is no mapping of fields")
    if (CHECKSUM in data) is not has_checksum:
        raise FileError("its checksum does not fit")
    data.pop(CHECKSUM, None)
    return CheckedJson(data, has_checksum)


def parsed(content: bytes, finite: bool = True) -> Any:
    """Return JSON as plain data. Raises FileError as `read_checked`."""
    if len(content) > MOST:
        raise FileError(f"has {in_mb(len(content))}, more than the {in_mb(MOST)} that are read")
    try:
        data = json.loads(content.decode("utf-8"), object_pairs_hook=_fields, parse_constant=_constant(finite))
    except UnicodeDecodeError:
        raise FileError("is no text in UTF-8") from None
    except json.JSONDecodeError as error:
        raise FileError(f"line {error.lineno}: {error.msg}") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise FileError(f"has a number that can't be read ({str(error).partition(':')[0]})") from None
    except RecursionError:
        raise FileError(f"is nested more than {DEEPEST} levels deep") from None
    _check(data, finite)
    return data


def _fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise FileError(f"has the field {twice[:40]!a} twice")
    return data


def _constant(finite: bool) -> Any:
    def value(text: str) -> float:
        if finite:
            raise FileError(f"has the number {text}, expected finite numbers")
        return float(text)

    return value


def _check(data: Any, finite: bool) -> None:
    """Raise FileError for content that `json` accepts and `read_checked` excludes."""
    todo = [(data, 0)]
    while todo:
        value, depth = todo.pop()
        if isinstance(value, (dict, list)):
            if depth == DEEPEST:
                raise FileError(f"is nested more than {DEEPEST} levels deep")
            parts = [*value, *value.values()] if isinstance(value, dict) else value
            todo += [(part, depth + 1) for part in parts]
        elif isinstance(value, str) and not value.isascii() and _HALF.search(value):
            raise FileError("has a text with half a character (a lone surrogate)")
        elif isinstance(value, int) and abs(value) > LARGEST:
            raise FileError("has a whole number of more than 300 digits")
        elif finite and isinstance(value, float) and not math.isfinite(value):
            raise FileError("has a number beyond the range of 64 bits, expected finite numbers")

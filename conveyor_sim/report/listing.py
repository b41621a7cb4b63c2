# SPDX-License-Identifier: Apache-2.0
"""Listings of records in plain text: one line per record where it fits; names are never broken."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

_GAP = "  "
_LEAST_TEXT = 20
"""Characters that a text beside its cells must have; with less room, it stands below them."""
_INDENT = " " * 4


class ListingRow(NamedTuple):
    """One record of a listing."""

    cells: tuple[str, ...]
    """Short values, which are never broken."""
    text: str = ""
    """Text that may be wrapped between words."""


def listing(
    headings: Sequence[str], records: Sequence[ListingRow], width: int | None, right: Sequence[int] = ()
) -> list[str]:
    """Return the lines of a listing, the headings first.

    headings: one per cell, and one for the text. width: characters of a line; None: without limit, one line per record.
    right: indices of right-aligned cells.
    """
    cells = [tuple(headings[:-1]), *(record.cells for record in records)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    taken = sum(widths) + len(_GAP) * len(widths)
    longest = max((len(record.text) for record in records), default=0)
    beside = width is None or taken + min(longest, _LEAST_TEXT) <= width
    heads = ListingRow(tuple(headings[:-1]), headings[-1] if beside else "")
    lines = []
    for record in (heads, *records):
        aligned = [
            cell.rjust(size) if index in right else cell.ljust(size)
            for index, (cell, size) in enumerate(zip(record.cells, widths, strict=True))
        ]
        first = _GAP.join(aligned)
        if width is None:
            lines.append(f"{first}{_GAP}{record.text}")
        elif beside:
            parts = _wrapped(record.text, width - taken) or [""]
            lines += [f"{first}{_GAP}{parts[0]}", *(" " * taken + part for part in parts[1:])]
        else:
            lines += [first.rstrip()] if len(first.rstrip()) <= width else _stacked(record.cells, width)
            lines += [_INDENT + part for part in _wrapped(record.text, width - len(_INDENT))]
    return [line.rstrip() for line in lines]


def matches(text: str, patterns: Sequence[str]) -> bool:
    """Return True if a pattern such as `machines/*` matches the text, or if there are no patterns."""
    return not patterns or any(fnmatchcase(text, pattern) for pattern in patterns)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, max(width, 1), break_long_words=False, break_on_hyphens=False)


def _stacked(cells: Sequence[str], width: int) -> list[str]:
    """Return lines with as many cells as fit into each, for records that are wider than the terminal."""
    lines = [""]
    for cell in filter(None, (cell.strip() for cell in cells)):
        longer = f"{lines[-1]}{_GAP}{cell}" if lines[-1] else cell
        if len(longer) <= width or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(_INDENT + cell)
    return lines

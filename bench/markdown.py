# SPDX-License-Identifier: Apache-2.0
"""Tables of Markdown, and their place between the markers of a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bench.rows import Spread


def table(head: Sequence[str], body: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table; a value that wasn't measured (None) is a dash. Numbers are aligned right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *([_cell(cell) for cell in line] for line in body)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def insert(document: Path, name: str, text: str) -> None:
    """Replace what stands between `<!-- bench: NAME -->` and `<!-- end: NAME -->`.

    Raises ValueError if the document has no such markers.
    """
    before, start, rest = document.read_text().partition(f"<!-- bench: {name} -->\n")
    _, end, after = rest.partition(f"<!-- end: {name} -->")
    if not end:
        raise ValueError(f"{document}: expected the markers <!-- bench: {name} --> and <!-- end: {name} -->")
    document.write_text(f"{before}{start}\n{text.strip()}\n\n{end}{after}")


def _cell(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, Spread):
        return str(value)
    return f"{value:,g}".replace(",", " ") if isinstance(value, (int, float)) else str(value)

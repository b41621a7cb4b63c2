# SPDX-License-Identifier: Apache-2.0
"""The parts of a page that are made by a study: between markers, all else is written by hand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def with_parts(page: Path, text: str, parts: Mapping[str, str]) -> str:
    """Return a page's text with each part between its markers replaced. Raise ValueError without them."""
    for name, part in parts.items():
        before, start, rest = text.partition(f"<!-- study: {name} -->\n")
        _, end, after = rest.partition(f"<!-- end: {name} -->")
        if not end:
            raise ValueError(f"{page}: expected the markers <!-- study: {name} --> and <!-- end: {name} -->")
        text = f"{before}{start}\n{part.strip()}\n\n{end}{after}"
    return text

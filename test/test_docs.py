# SPDX-License-Identifier: Apache-2.0
"""What the pages of docs/ name is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = sorted(
    [
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "CHANGELOG.md",
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "conveyor_sim").rglob("*.md"),
    ]
)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_tests_that_a_page_names_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    files = {page.parent / link for link in re.findall(r"\]\((?!https?:)([^)#\s]+)", text)}
    files |= {ROOT / name for name in re.findall(r"`(test/[\w/]+\.(?:py|yaml))`", text)}
    assert [str(file) for file in sorted(files) if not file.exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_headings_that_a_page_links_to_are_there(page: Path) -> None:
    for link, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)#([^)\s]+)\)", page.read_text(encoding="utf-8")):
        target = page.parent / link if link else page
        headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
        anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
        assert anchor in anchors, f"{link}#{anchor}"


FOLDERS = ("bench", "conveyor_sim", "docs", "examples", "test", "tools")
SOURCES = {
    "setup.py",
    *(source.relative_to(ROOT).as_posix() for name in FOLDERS for source in (ROOT / name).rglob("*.py")),
}
WRITTEN = sorted([*PAGES, *(ROOT / "conveyor_sim").rglob("*.py")])


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_a_page_or_a_docstring_names_are_there(page: Path) -> None:
    """By the end of their path: `near.py`, `engine/lists/near.py`."""
    text = re.sub(r"[Ss]ave (this|it)\s+as\s+`\S+`", "", page.read_text(encoding="utf-8"))  # files of the reader
    named = re.findall(r"`([\w/]+\.py)`", text)
    assert [name for name in named if not any(f"/{source}".endswith(f"/{name}") for source in SOURCES)] == []

# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md and docs/performance/: commands run, tables and pictures follow from the raw numbers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from shell_blocks import Command, snippets
from study_page import load_study
from warm import run

from bench.__main__ import PARTS
from bench.rows import Rows

ROOT = Path(__file__).parents[2]
RAW = ROOT / "docs" / "performance"
INDEX = ROOT / "docs" / "performance.md"
PAGES = sorted(RAW.glob("*.md"))
COMMANDS = {
    command.words: page.name
    for page in (INDEX, *PAGES)
    for command in snippets(page.read_text(encoding="utf-8"))
    if isinstance(command, Command)
}
MEASURED = {words: page for words, page in COMMANDS.items() if words[0] == "make"}
RUN = {words: page for words, page in COMMANDS.items() if words[0] != "make" and "bench" not in words}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_has_a_picture_of_its_numbers(page: Path) -> None:
    names = re.findall(r"\]\(\.\./images/performance_(\w+)\.webp\)", page.read_text(encoding="utf-8"))
    assert names
    pictures = load_study("performance_pictures").PICTURES
    for name in names:
        (ax,) = pictures[name]().axes
        assert len(ax.patches) + sum(len(line.get_xdata()) for line in ax.lines) >= 3
        assert ax.get_xlabel()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_names_the_command_that_measures_its_tables(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    (arguments,) = [words[2].removeprefix("ARGS=") for words, name in MEASURED.items() if name == page.name]
    assert set(arguments.split()) == set(re.findall(r"<!-- bench: (\w+) -->", text))


def test_parts_that_pages_name_exist() -> None:
    named = {part for words in MEASURED for word in words[2:] for part in word.removeprefix("ARGS=").split()}
    assert named - {"--quick"} <= set(PARTS)


@pytest.mark.parametrize("part", PARTS)
def test_a_table_follows_from_the_raw_numbers(part: str) -> None:
    pages = [*PAGES, ROOT / "docs" / "studies" / "performance_history.md"]
    assert PARTS[part].tables(Rows.read(RAW / f"{part}.csv")) in "".join(page.read_text() for page in pages)


@pytest.mark.parametrize("words", RUN, ids=lambda words: " ".join(words)[:60])
def test_a_command_runs(words: tuple[str, ...], tmp_path: Path) -> None:
    for name in ("config", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    words = words[1:] if words[0] == "time" else words
    if words[0] == "conveyor-sim":
        arguments = ["-c", "from conveyor_sim.cli import main; main()", *words[1:]]
    else:
        assert words[:3] == ("python", "-m", "timeit")
        arguments = ["-m", "timeit", "-n", "1", "-r", "1", *words[3:]]  # once, in place of a measurement
    done = run(arguments, cwd=tmp_path, timeout=600.0)
    assert done.returncode == 0, done.stderr


def test_raw_numbers_belong_to_a_table() -> None:
    pages = "".join(page.read_text(encoding="utf-8") for page in [INDEX, *PAGES, *(ROOT / "docs/studies").glob("*.md")])
    code = "".join(path.read_text() for path in (ROOT / "bench").glob("*.py"))
    files = {path.name for path in RAW.glob("*.csv")}
    assert {name for name in files if name not in pages and name not in code} == set()

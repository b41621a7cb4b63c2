# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/cookbook/ word for word: their tests pass, and fail without the controller."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from shell_blocks import Block, Command, snippets

from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

DOCS = Path(__file__).resolve().parents[2] / "docs"
COOKBOOK = DOCS / "cookbook"
PAGES = sorted(page for page in COOKBOOK.glob("*.md") if page.stem != "index")
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")
MOST_LINES, MOST_SCENE_LINES, MOST_BYTES = 120, 30, 60_000
"""Lines of a page and of its scene, bytes of its picture."""


def files(page: Path) -> dict[str, str]:
    """Return the files that a page asks the reader to save, by name."""
    named = {block.name: block.text for block in snippets(page.read_text()) if isinstance(block, Block) and block.name}
    programs = re.findall(r"^```\n\(\* (\S+\.st) \*\)\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)
    return named | dict(programs)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_tests_of_a_page_pass_and_fail_without_its_controller(page: Path, pytester: pytest.Pytester) -> None:
    for name, text in files(page).items():
        (pytester.path / name).write_text(text)
    (command,) = [
        each for each in snippets(page.read_text()) if isinstance(each, Command) and each.words[0] == "pytest"
    ]
    test = pytester.path / command.words[1]
    tests = len(re.findall(r"^def test_", test.read_text(), re.MULTILINE))
    pytester.runpytest_inprocess(*PLUGIN, test.name).assert_outcomes(passed=tests)
    test.write_text(re.sub(r"^    +plant\.attach\(.*\n", "", test.read_text(), flags=re.MULTILINE))
    assert pytester.runpytest_inprocess(*PLUGIN, "-x", test.name).parseoutcomes()["failed"] == 1


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_is_short_and_complete(page: Path) -> None:
    text = page.read_text()
    assert text.count("\n") <= MOST_LINES
    (scene,) = [name for name in files(page) if name.endswith(".yaml")]
    assert files(page)[scene].count("\n") <= MOST_SCENE_LINES
    assert f"](../images/cookbook/{page.stem}.webp)" in text
    assert (DOCS / "images" / "cookbook" / f"{page.stem}.webp").stat().st_size <= MOST_BYTES
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert headings == ["Scene", "Controller", "Test", "What goes wrong", "Accuracy"]
    (serve,) = re.findall(r"^    conveyor-sim serve (\S+) --controller ([^\s:]+)\S* --web$", text, re.MULTILINE)
    assert set(serve) < set(files(page))
    assert f"]({page.name})" in (COOKBOOK / "index.md").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_shipped_scene_is_the_one_of_its_page(page: Path, tmp_path: Path) -> None:
    """A page may show a shipped scene, and then says so. The shipped file has comments besides."""
    (scene,) = [name for name in files(page) if name.endswith(".yaml")]
    for name in re.findall(r"`(scenarios/\w+)` is this scene", page.read_text()):
        shipped = re.sub(r"\A(#.*\n)+", "", scene_path(name).read_text())
        assert shipped == files(page)[scene]
    (tmp_path / scene).write_text(files(page)[scene])
    assert load_scene(tmp_path / scene).name == page.stem or "is this scene" in page.read_text()

# SPDX-License-Identifier: Apache-2.0
"""The README's snippets are the files under examples/, and they run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def block(language: str, start: str) -> str:
    """Return the code block of a language that begins with a text."""
    (found,) = re.findall(rf"```{language}\n({start}.*?)```", README, re.DOTALL)
    return str(found)


def test_scene_is_the_example() -> None:
    assert block("yaml", "name: push") == (ROOT / "examples" / "push.yaml").read_text()


def test_python_is_the_example() -> None:
    text = (ROOT / "examples" / "simulate.py").read_text()
    assert text.split('"""\n\n', 1)[1] == block("python", "from conveyor_sim")


def test_first_scenario_is_the_one_that_is_tested() -> None:
    """test/testing/test_documented.py runs it."""
    documented = (ROOT / "docs" / "testing_control_logic.md").read_text()
    first = re.search(r"```python\n# test_first.py\n(.*?)```", documented, re.DOTALL)
    assert first is not None
    assert f"```python\n# test_first.py\n{first.group(1)}```" in README


PAGES = sorted(page for page in (ROOT / "docs").glob("*.md") if page.name != "index.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_index_links_every_page_once(page: Path) -> None:
    assert (ROOT / "docs" / "index.md").read_text().count(f"]({page.name}") == 1


def test_python_example_runs() -> None:
    done = subprocess.run(
        [sys.executable, "examples/simulate.py"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    # The queue's first bottle presses against the stop at 1.9 m, a radius of 33 mm before it; the command was accepted.
    assert "accepted=True" in done.stdout
    assert re.search(r"\[1\.8(67|68|69)", done.stdout)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"\]\(([^)#:]+)\)", README))))
def test_links_lead_somewhere(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize("path", sorted(set(re.findall(r"examples/\w+\.(?:py|yaml)", README))))
def test_examples_named_exist(path: str) -> None:
    assert (ROOT / path).exists()

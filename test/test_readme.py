"""The README's snippets are the files under examples/, and they run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found.group(1)


def test_scene_is_the_example() -> None:
    assert block("yaml") == (ROOT / "examples" / "push.yaml").read_text()


def test_python_is_the_example() -> None:
    text = (ROOT / "examples" / "simulate.py").read_text()
    assert text.split('"""\n\n', 1)[1] == block("python")


def test_first_scenario_is_the_one_that_is_tested() -> None:
    """test/testing/test_documented.py runs it."""
    documented = (ROOT / "docs" / "testing_control_logic.md").read_text()
    first = re.search(r"```python\n# test_first.py\n(.*?)```", documented, re.DOTALL)
    assert first is not None
    assert f"```python\n# test_first.py\n{first.group(1)}```" in README


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.name)
def test_every_page_is_linked_once(page: Path) -> None:
    assert README.count(f"](docs/{page.name}") == 1


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

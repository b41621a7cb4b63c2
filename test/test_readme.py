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


def test_python_example_runs() -> None:
    done = subprocess.run(
        [sys.executable, "examples/simulate.py"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    # Two bottles fed at 4/s in the first half second have come onto the belt at 0.1 m/s; they touch nothing yet.
    assert re.fullmatch(r"\[0\.15\S* 0\.0\S*\] \[\]\n", done.stdout)


@pytest.mark.parametrize("path", sorted(set(re.findall(r"\]\(([^)#:]+)\)", README))))
def test_links_lead_somewhere(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize("path", sorted(set(re.findall(r"examples/\w+\.(?:py|yaml)", README))))
def test_examples_named_exist(path: str) -> None:
    assert (ROOT / path).exists()

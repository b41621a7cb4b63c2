# SPDX-License-Identifier: Apache-2.0
"""The worked examples of docs/extending.md work: each is applied to a copy of the package, and its last block is run.

A section is a heading `## ...` with fenced blocks that have a title: `python title="conveyor_sim/..."` and
`text title="msg_defs/..."` are whole files, `diff` changes files that are there, `python title="try"` is the script.
"""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "extending.md"
COPIED = ("conveyor_sim", "msg_defs", "config")
TRY = "try"
DIFF = r"^--- a/(\S+)\n\+\+\+ b/(\S+)\n((?:(?!--- a/)(?:[-+ @\\].*)?\n)*)"
"""Both names of a file, and its hunks."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its title, and what is in it."""

    language: str
    title: str
    text: str


def sections_of(page: str) -> dict[str, list[Block]]:
    """The blocks of a page with a title, and those of changes, by the heading that they stand under."""
    found: dict[str, list[Block]] = {}
    for part in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        heading, _, body = part.partition("\n")
        fences = re.findall(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", body, re.DOTALL | re.MULTILINE)
        found[heading] = [Block(*fence) for fence in fences if fence[1] or fence[0] == "diff"]
    return found


def apply_block(block: Block, folder: Path) -> None:
    """Write a new file, or change files that are there."""
    if block.language == "diff":
        for old, new, body in re.findall(DIFF, block.text, re.MULTILINE):
            assert old == new, f"{old} has another name afterwards, {new}"
            change(folder / old, body)
    else:
        file = folder / block.title
        assert not file.exists(), f"{block.title} is there already: it takes a diff"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(block.text)


def change(file: Path, hunks: str) -> None:
    """Lay the hunks of a unified diff over a file. What a hunk takes away has to be there, in one place."""
    text = file.read_text()
    for hunk in re.split(r"^@@.*\n", hunks, flags=re.MULTILINE)[1:]:
        lines = [line or " " for line in hunk.rstrip("\n").split("\n")]
        before = "".join(f"{line[1:]}\n" for line in lines if line[0] in " -")
        after = "".join(f"{line[1:]}\n" for line in lines if line[0] in " +")
        assert text.count(before) == 1, f"{file.name} has {text.count(before)} places for this:\n{before}"
        text = text.replace(before, after)
    file.write_text(text)


def apply(blocks: list[Block], folder: Path) -> None:
    """A copy of the package in a folder, with all blocks of a section but the last."""
    for name in COPIED:
        # With what Python has compiled of files that stay as they are, but not what it is just writing.
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("*.pyc.*"))
    for block in blocks:
        if block.title != TRY:
            apply_block(block, folder)


def run_script(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a script in a folder, with the package that lies there."""
    given = f"import conveyor_sim; assert conveyor_sim.__file__.startswith({str(folder)!r}), conveyor_sim.__file__\n"
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    (folder / "try.py").write_text(given + script)
    return subprocess.run(
        [sys.executable, "try.py"], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


SECTIONS = sections_of(PAGE.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", SECTIONS)
def test_a_worked_example_works(name: str, tmp_path: Path) -> None:
    blocks = SECTIONS[name]
    assert [block.title for block in blocks].count(TRY) == 1
    assert blocks[-1].title == TRY
    apply(blocks, tmp_path)
    done = run_script(blocks[-1].text, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


EXAMPLE = """\
# A page

## First
Text with code that is no step:

```python
not_a_step()
```

```python title="conveyor_sim/answer.py"
ANSWER = 42
```

```diff
--- a/conveyor_sim/errors.py
+++ b/conveyor_sim/errors.py
@@ -1,2 +1,3 @@
%s
+ADDED = 1
--- a/conveyor_sim/scene/drives.py
+++ b/conveyor_sim/scene/drives.py
@@ -1,2 +1,3 @@
%s
+MORE = 1
```

```python title="try"
from conveyor_sim.answer import ANSWER
from conveyor_sim.errors import ADDED
from conveyor_sim.scene.drives import MORE

assert ANSWER + ADDED + MORE == 44
```

## Second
Nothing.
"""


def example() -> list[Block]:
    files = ("errors.py", "scene/drives.py")
    lines = [(ROOT / "conveyor_sim" / file).read_text().splitlines()[1] for file in files]  # below the license
    first = tuple(f" {line}" for line in lines)
    sections = sections_of(EXAMPLE % first)
    assert list(sections) == ["First", "Second"]
    assert sections["Second"] == []
    return sections["First"]


def test_blocks_are_applied_to_the_copy_and_to_nothing_else(tmp_path: Path) -> None:
    before = (ROOT / "conveyor_sim" / "errors.py").read_text()
    blocks = example()
    assert [block.language for block in blocks] == ["python", "diff", "python"]
    apply(blocks, tmp_path)
    done = run_script(blocks[-1].text, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert run_script("assert False", tmp_path).returncode == 1
    assert (ROOT / "conveyor_sim" / "errors.py").read_text() == before
    assert not (ROOT / "conveyor_sim" / "answer.py").exists()


def test_a_change_of_what_is_not_there_and_a_new_file_that_is_are_refused(tmp_path: Path) -> None:
    new, change_, _ = example()
    apply([new, change_], tmp_path)
    with pytest.raises(AssertionError, match=r"answer\.py is there already"):
        apply_block(new, tmp_path)
    with pytest.raises(AssertionError, match=r"errors\.py has 0 places"):
        apply_block(Block("diff", "", change_.text.replace(' """', " '''")), tmp_path)

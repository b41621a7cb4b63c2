# SPDX-License-Identifier: Apache-2.0
"""The hash over the sources that decide bits: what goes into it, and what does not."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import conveyor_sim

HASH = "from conveyor_sim.physics.sources_hash import version_hashes; print(*version_hashes())"


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A folder with a copy of the package, to edit."""
    source = Path(conveyor_sim.__file__).parent
    shutil.copytree(source, tmp_path / "conveyor_sim", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def hash_of(folder: Path) -> str:
    """As a new interpreter finds it that imports from a folder."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", HASH], cwd=folder, env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_what_decides_bits_changes_the_hash_and_nothing_else_does(copied: Path) -> None:
    package, before = copied / "conveyor_sim", hash_of(copied)

    def edited(*edits: tuple[str, str, str]) -> str:
        """The hash with edits: file, old text, new text."""
        texts = {package / file: (package / file).read_text() for file, _, _ in edits}
        for file, old, new in edits:
            assert old in texts[package / file], f"{file} has no {old!r}"
            (package / file).write_text(texts[package / file].replace(old, new, 1))
        found = hash_of(copied)
        for source, text in texts.items():
            source.write_text(text)
        return found

    assert [len(part) for part in before.split()] == [16, 8]
    unused = "\n\n\n", "\n\n\nUNUSED = 1\n\n\n"
    assert edited(("engine/integrators/motion.py", *unused)) != before
    assert edited(("scene/geometry.py", *unused)) != before
    assert edited(("physics/stepping/guard/guard.py", "DEEPEST = 0.75", "DEEPEST = 0.74")) != before
    assert edited(("line/devices/entry.py", *unused)) != before
    assert edited(("simulation.py", "def state_hash(self", "def bits(self")) != before
    comment = "\n\n\n", "\n\n\n# A comment.\n"
    without_effect = (
        ("physics/stepping/guard/guard.py", *comment),
        ("cli/run.py", *unused),
        ("report/figures/style.py", *unused),
    )
    assert edited(*without_effect) == before

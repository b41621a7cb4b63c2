# SPDX-License-Identifier: Apache-2.0
"""A short run of what `make fuzz` does to the text of scenes, always of the same cases."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fuzz.targets.scenes_text import attack


def test_whatever_the_text(tmp_path: Path) -> None:
    came: Counter[str] = Counter()
    for seed in range(100):
        folder = tmp_path / str(seed)
        folder.mkdir()
        came[attack(seed, folder)] += 1
    assert came["refused"] > 50
    assert came["read"] > 0

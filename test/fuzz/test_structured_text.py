# SPDX-License-Identifier: Apache-2.0
"""A short run of what `make fuzz` does to programs in Structured Text, always of the same cases."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fuzz.targets.structured_text import attack


def test_whatever_the_program(tmp_path: Path) -> None:
    came: Counter[str] = Counter()
    for seed in range(500):
        came[attack(seed, tmp_path)] += 1
    assert came["refused"] > 200
    assert came["ran"] > 10
    assert came["stopped"] > 3

# SPDX-License-Identifier: Apache-2.0
"""A short run of what `make fuzz` does to layouts, always of the same cases."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fuzz.targets.layouts import attack


def test_malformed_layouts_are_refused_in_words(tmp_path: Path) -> None:
    results: Counter[str] = Counter()
    for seed in range(60):
        folder = tmp_path / str(seed)
        folder.mkdir()
        results[attack(seed, folder)] += 1
    assert results["refused"] > 20
    assert results["read"] > 2

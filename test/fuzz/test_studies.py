# SPDX-License-Identifier: Apache-2.0
"""A seeded sample of what `make fuzz` does to folders of studies."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from fuzz.targets.studies import attack

pytest.importorskip("pyarrow")

SAMPLE = 60


def test_damaged_studies_go_on_or_say_why_not(tmp_path: Path) -> None:
    outcomes: Counter[str] = Counter()
    for seed in range(SAMPLE):
        place = tmp_path / str(seed)
        place.mkdir()
        outcomes[attack(seed, place)] += 1
    assert outcomes["refused, went on with some runs"] > 5
    assert len(outcomes) > 5

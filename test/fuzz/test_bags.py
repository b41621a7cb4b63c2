# SPDX-License-Identifier: Apache-2.0
"""A seeded sample of what `make fuzz` does to bags."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from fuzz.targets.bags import attack

SAMPLE = 12
"""Cases a batch."""


@pytest.mark.parametrize("batch", range(2))
def test_damaged_bags_are_read_right_or_not_at_all(batch: int, tmp_path: Path) -> None:
    outcomes: Counter[str] = Counter()
    for seed in range(SAMPLE * batch, SAMPLE * (batch + 1)):
        place = tmp_path / str(seed)
        place.mkdir()
        outcomes[attack(seed, place)] += 1
    assert outcomes["repaired"] > 1
    assert len(outcomes) > 2

# SPDX-License-Identifier: Apache-2.0
"""A short run of what `make fuzz` does to checkpoints, always of the same cases."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from fuzz.targets.checkpoints import attack


@pytest.mark.parametrize("batch", range(3))
def test_whatever_the_file(batch: int, tmp_path: Path) -> None:
    came = Counter(attack(seed, tmp_path) for seed in range(100 * batch, 100 * (batch + 1)))
    assert came["refused"] > 50
    assert came["another state"] > 0

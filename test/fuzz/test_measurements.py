# SPDX-License-Identifier: Apache-2.0
"""A seeded sample of what `make fuzz` does to files of measurements."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fuzz.targets.measurements import attack

SAMPLE = 200


def test_damaged_measurements_are_calibrated_or_refused(tmp_path: Path) -> None:
    outcomes = Counter(attack(seed, tmp_path) for seed in range(SAMPLE))
    assert set(outcomes) == {"calibrated", "refused"}
    assert min(outcomes.values()) > SAMPLE / 10

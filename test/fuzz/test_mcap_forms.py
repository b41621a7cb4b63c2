# SPDX-License-Identifier: Apache-2.0
"""A seeded sample of what `make fuzz` does with forms of MCAP."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fuzz.targets.mcap_forms import attack

SAMPLE = 10


def test_any_form_is_read_as_the_library_reads_it(tmp_path: Path) -> None:
    outcomes: Counter[str] = Counter()
    for seed in range(SAMPLE):
        place = tmp_path / str(seed)
        place.mkdir()
        outcomes[attack(seed, place)] += 1
    assert any("repaired" in outcome for outcome in outcomes)
    assert len(outcomes) > 2

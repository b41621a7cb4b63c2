# SPDX-License-Identifier: Apache-2.0
"""The frame of `make fuzz`: what a target does wrong is counted, kept, and can be played again."""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest
from fuzz import attack
from fuzz.invariants import Violation
from fuzz.report import Figures


@pytest.fixture
def target(monkeypatch: pytest.MonkeyPatch) -> str:
    """A target that fails at every tenth seed, and leaves a file, a FIFO and a sparse terabyte behind."""

    def play(seed: int, folder: Path) -> str:
        (folder / "input.txt").write_text(str(seed))
        os.mkfifo(folder / "pipe")
        (folder / "huge").touch()
        os.truncate(folder / "huge", 10**12)
        if seed % 10 == 7:
            raise Violation("seven", f"{seed} ends in seven")
        return "odd" if seed % 2 else "even"

    module = ModuleType("fuzz.targets.sevens")
    module.attack = play  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "fuzz.targets.sevens", module)
    monkeypatch.setattr(attack, "MEMORY", -1)  # the limit would stay with this process: RLIM_INFINITY
    return "sevens"


def test_failures_are_counted_and_the_first_of_a_kind_is_kept(target: str, tmp_path: Path) -> None:
    place = tmp_path / "portion"
    place.mkdir()
    known: set[str] = set()
    attack.main(target, 3, 0.5, place, known)
    tally = json.loads((place / "result.json").read_text())
    counts = Counter(tally["counts"])
    assert known == {"sevens: seven"} == set(tally["failures"])
    assert counts["failed"] == tally["failures"]["sevens: seven"] >= 1
    assert counts["even"] > counts["odd"] > 0
    kept = Path(tally["shrunk"]["sevens: seven"])
    assert "--again sevens:3000007" in kept.read_text()
    assert {file.name for file in kept.parent.iterdir()} == {"input.txt", "failure.txt"}
    assert (kept.parent / "input.txt").read_text() == "3000007"
    assert not (place / "case").exists()


def test_a_kind_that_is_known_is_not_kept_again(target: str, tmp_path: Path) -> None:
    place = tmp_path / "portion"
    place.mkdir()
    attack.main(target, 0, 0.2, place, {"sevens: seven"})
    tally = json.loads((place / "result.json").read_text())
    assert tally["failures"] and not tally["shrunk"]


def test_figures_add_the_portions_of_a_target() -> None:
    figures = Figures(0)
    for counts in ({"refused": 1200, "failed": 1}, {"refused": 34}):
        figures.add({"target": "bags", "counts": counts, "failures": {"bags: lost": 1}, "shrunk": {}})
    text = figures.markdown()
    assert "- bags: 1,235 cases: 1,234 refused, 1 failed" in text
    assert "2 **failed**: bags: lost" in text
    assert "scenes tried" not in text

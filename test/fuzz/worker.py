# SPDX-License-Identifier: Apache-2.0
"""One process of a long run: cases of one family for some time, each told before it is played, for a crash ends it."""

from __future__ import annotations

import json
import resource
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fuzz.case import Case, cases
from fuzz.families import Family, random_family
from fuzz.play import failure_kind, play
from fuzz.scenes import WILD
from fuzz.wrong import judge, wrong_texts
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

CURRENT, RESULT = "current", "result.json"
SHRINK_TIME = 90.0
"""s for making the first failure of a kind smaller."""
BATCH = 25
"""Cases drawn from one seed."""
TEXTS = 30
"""Wrong scenes read for each batch of cases."""
MEMORY = 8 * 2**30
"""bytes, so that what asks for more than any machine has is refused and told, not the end of the machine."""


@dataclass
class Tally:
    """Figures of one family."""

    family: str
    integrator: str
    counts: Counter[str] = field(default_factory=Counter)
    """Cases by how they ended, and sums over them."""
    stopped: Counter[str] = field(default_factory=Counter)
    """By kind of SimulationError."""
    failures: Counter[str] = field(default_factory=Counter)
    """By kind."""
    simulated: float = 0.0
    """s"""
    largest: int = 0
    """Bottles in one case."""
    shrunk: dict[str, str] = field(default_factory=dict)
    """File of the smallest case, by kind of failure."""


class Hunt:
    """Looks for failures of kinds that are not known yet, and makes each as small as it can in SHRINK_TIME."""

    def __init__(self, folder: Path, tally: Tally, known: set[str]) -> None:
        self._folder, self._tally, self._known = folder, tally, known

    def search(self, strategy: st.SearchStrategy[Any], attempt: Any, save: Any, number: int, examples: int) -> None:
        """Draws examples from a seed; attempt(example) raises where one fails, save(example, kind, text) keeps it."""
        target: list[str] = []
        failing: dict[str, tuple[Any, str]] = {}
        until = [0.0]

        @seed(number)
        @settings(
            max_examples=examples,
            database=None,  # a kind that was found stays in the list of kinds, its case in a file
            deadline=None,  # the first case of a mixture compiles for half a minute
            suppress_health_check=list(HealthCheck),  # scenes are large and slow to draw by their nature
            phases=[Phase.generate, Phase.shrink],
            report_multiple_bugs=False,
        )
        @given(strategy)
        def hunt(example: Any) -> None:
            text = repr(example)
            if target and time.monotonic() > until[0] and text not in failing:
                return
            try:
                attempt(example, counted=not target)
            except Exception as error:
                kind = failure_kind(error)
                if not target:
                    self._tally.failures[kind] += 1
                    if kind in self._known:
                        return
                    target.append(kind)
                    until[0] = time.monotonic() + SHRINK_TIME
                if kind == target[0]:
                    failing[text] = example, str(error)
                    raise

        try:
            hunt()
        except Exception:
            if not failing:
                raise
            smallest = min(failing, key=len)
            self._known.add(target[0])
            self._tally.shrunk[target[0]] = str(save(*failing[smallest], target[0]))

    def play(self, case: Case, counted: bool) -> None:
        """Plays a case, told before."""
        case.save(self._folder, CURRENT)
        try:
            played = play(case)
        except Exception:
            self._tally.counts["failed"] += counted
            raise
        if not counted:
            return
        counts = self._tally.counts
        counts[played.how] += 1
        for name in ("ticks", "bottles", "bottle_ticks", "contacts", "replayed"):
            counts[name] += getattr(played, name)
        self._tally.simulated += played.simulated
        self._tally.largest = max(self._tally.largest, played.bottles)
        if played.how == "stopped":
            kind = ("beyond physics: " if case.scene["description"] == WILD else "") + played.kind
            if kind not in self._tally.stopped:
                case.save(self._folder, slug(f"stopped {kind}"), played.sentence)
            self._tally.stopped[kind] += 1

    def judge(self, text: str, counted: bool) -> None:
        """Reads a scene that may be wrong."""
        (self._folder / f"{CURRENT}.yaml").write_text(text, encoding="utf-8")
        judged = judge(text)
        if counted:
            self._tally.counts["texts refused" if judged.refused else "texts taken"] += 1

    def save_case(self, case: Case, sentence: str, kind: str) -> Path:
        """Keeps a failing case beside the folder of this family."""
        return case.save(self._folder.parent, slug(kind), sentence)

    def save_text(self, text: str, sentence: str, kind: str) -> Path:
        """Keeps a failing text."""
        file = self._folder.parent / f"{slug(kind)}.yaml"
        file.write_text("".join(f"# {line}\n" for line in sentence.splitlines()) + text, encoding="utf-8")
        return file


def slug(kind: str) -> str:
    """A kind of failure as the name of a file."""
    return "_".join("".join(c if c.isalnum() else " " for c in kind).split())[:80]


def main(number: int, seconds: float, folder: Path, known: set[str]) -> None:
    """Cases of the family of a seed for some time; the figures are renewed in RESULT after each batch."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    family: Family = random_family(number)
    tally = Tally(str(family), family.integrator)
    hunt, end, batch = Hunt(folder, tally, known), time.monotonic() + seconds, 0
    while batch == 0 or time.monotonic() < end:
        hunt.search(cases(family), hunt.play, hunt.save_case, 1000 * number + batch, BATCH)
        hunt.search(wrong_texts(family), hunt.judge, hunt.save_text, 1000 * number + batch, TEXTS)
        batch += 1
        (folder / RESULT).write_text(json.dumps(tally.__dict__), encoding="utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]), set(json.loads(sys.argv[4])))

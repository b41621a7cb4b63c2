# SPDX-License-Identifier: Apache-2.0
"""One process of a long run: the cases of a target in `targets/`, seed by seed, for some time.

The present seed is written down before it is played, so that a crash or a hang can be played again.
"""

from __future__ import annotations

import json
import resource
import shutil
import sys
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from fuzz.play import failure_kind
from fuzz.worker import CURRENT, MEMORY, RESULT, slug

TARGETS = tuple(sorted(file.stem for file in (Path(__file__).parent / "targets").glob("*.py")))
"""Names of the modules in `targets/`."""
SEEDS = 1_000_000
"""Seeds from the first of a portion to the first of the next."""
LARGEST = 64 * 2**20
"""bytes of a file that is kept of a failed case."""
RENEW = 2.0
"""s from one writing of the figures to the next."""


class Attack(Protocol):
    """What a target is: one case from a seed, played in an empty folder.

    Returns in a word or two what came of it. Raises Violation, or anything else, where something is wrong.
    """

    def __call__(self, seed: int, folder: Path) -> str: ...


@dataclass
class Tally:
    """Figures of one portion."""

    target: str
    counts: Counter[str] = field(default_factory=Counter)
    """Cases by what came of them."""
    failures: Counter[str] = field(default_factory=Counter)
    """By kind."""
    shrunk: dict[str, str] = field(default_factory=dict)
    """File that says how to play it again, by kind of failure."""


def attack_of(target: str) -> Attack:
    """The function `attack` of a target."""
    return cast(Attack, import_module(f"fuzz.targets.{target}").attack)


def main(target: str, number: int, seconds: float, place: Path, known: set[str]) -> None:
    """Plays the seeds of a portion for some time; the figures are renewed in RESULT as it goes."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    attack, tally = attack_of(target), Tally(target)
    seed, end, written = number * SEEDS, time.monotonic() + seconds, 0.0
    while not tally.counts or time.monotonic() < end:
        (place / f"{CURRENT}.yaml").write_text(f"target: {target}\nseed: {seed}\n", encoding="utf-8")
        folder = place / "case"
        folder.mkdir()
        try:
            tally.counts[attack(seed, folder)] += 1
        except Exception as error:
            kind = f"{target}: {failure_kind(error)}"
            tally.counts["failed"] += 1
            tally.failures[kind] += 1
            if kind not in known:
                known.add(kind)
                tally.shrunk[kind] = str(_keep(target, seed, kind, folder, place.parent))
        shutil.rmtree(folder, ignore_errors=True)
        seed += 1
        if time.monotonic() > written + RENEW:
            written = time.monotonic()
            (place / RESULT).write_text(json.dumps(tally.__dict__), encoding="utf-8")
    (place / RESULT).write_text(json.dumps(tally.__dict__), encoding="utf-8")


def _keep(target: str, seed: int, kind: str, folder: Path, beside: Path) -> Path:
    """Keeps the files of a failed case, with the error and the command that plays it again."""
    kept = beside / slug(kind)
    shutil.copytree(folder, kept, symlinks=True, ignore=_odd, dirs_exist_ok=True)
    report = kept / "failure.txt"
    again = f'make fuzz ARGS="--again {target}:{seed}"'
    report.write_text(f"{kind}\nagain: {again}\n\n{traceback.format_exc()}", encoding="utf-8")
    return report


def _odd(folder: str, names: list[str]) -> list[str]:
    """What is not copied: FIFOs and devices, which would be waited for, and files of a sparse terabyte."""
    return [name for name in names if not _is_plain(Path(folder) / name)]


def _is_plain(path: Path) -> bool:
    if path.is_symlink() or path.is_dir():
        return True
    return path.is_file() and path.stat().st_size <= LARGEST


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4]), set(json.loads(sys.argv[5])))

# SPDX-License-Identifier: Apache-2.0
"""Timing in turns: every contestant does one piece of work a round, and the rounds are many."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bench.rows import Row

RATE = "million bottle-steps/s"
CALIBRATION = 0.2
"""A piece is found long enough to judge from once it has taken this share of the time it should take."""


@dataclass(frozen=True)
class Effort:
    """Extent of the measurements."""

    rounds: int
    piece: float
    """s of wall time, of one contestant in one round."""
    quick: bool
    """Only to see that all works: the numbers mean little."""


@dataclass(frozen=True)
class Contestant:
    """Somebody who takes steps."""

    name: str
    work: Callable[[int], float]
    """Do so many units of work; how many bottle-steps that was."""
    n: float
    """Bottles, or whatever is varied."""


def say(text: str) -> None:
    """Progress, to the terminal."""
    print(f"[bench {time.strftime('%H:%M:%S')}] {text}", file=sys.stderr, flush=True)


def in_turns(contestants: Sequence[Contestant], effort: Effort, case: str) -> list[Row]:
    """RATE by contestant and round. The order turns by one each round."""
    pieces = [(contestant, _calibrated(contestant, effort.piece)) for contestant in contestants]
    rows = []
    for turn in range(effort.rounds):
        first = turn % len(pieces)
        for contestant, units in [*pieces[first:], *pieces[:first]]:
            start = time.perf_counter()
            bottle_steps = contestant.work(units)
            rate = 1e-6 * bottle_steps / (time.perf_counter() - start)
            rows.append(Row(case, contestant.n, contestant.name, RATE, turn, rate))
    return rows


def _calibrated(contestant: Contestant, piece: float) -> int:
    """Return how many units take about the time of a piece; kernels are compiled first."""
    contestant.work(1)
    units = 1
    while True:
        start = time.perf_counter()
        contestant.work(units)
        took = time.perf_counter() - start
        if took > CALIBRATION * piece:
            return max(1, round(units * piece / took))
        units *= 2

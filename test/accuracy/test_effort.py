# SPDX-License-Identifier: Apache-2.0
"""What a study may take, and what is left of it: processor time alone, so a busy machine changes neither."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from conveyor_sim.accuracy.effort import DEFAULT, PROCESSORS, RESERVE, THOROUGH, Effort, TimeLeft, bars_with_left


def test_what_one_process_measures_costs_the_other_processor_too() -> None:
    """200 s on two processors: 40 s of measuring leave 160 s of both, 120 s of one."""
    effort = Effort(budget=400.0)
    assert effort.long_runs(0.0) == 400.0
    assert effort.long_runs(40.0) == 320.0
    assert effort.long_runs(300.0) == 0.0


def test_five_minutes_of_two_processors_and_a_hundred_of_one() -> None:
    """A default study ends within 300 s of wall time on two free processors, with time left to start and to draw."""
    assert DEFAULT.budget / PROCESSORS <= 270.0
    assert DEFAULT.measuring < DEFAULT.budget / PROCESSORS
    for measured in (0.0, 30.0, DEFAULT.measuring):
        assert measured + DEFAULT.long_runs(measured) / PROCESSORS == DEFAULT.budget / PROCESSORS
    assert (THOROUGH.budget, THOROUGH.measuring) == (6000.0, math.inf)


class Shown:
    def __init__(self) -> None:
        self.updates: list[tuple[float, float | None, float | None]] = []

    def update(self, done: float, total: float | None = None, left: float | None = None) -> None:
        self.updates.append((done, total, left))


@pytest.mark.parametrize("left", [120.0, None])
def test_each_update_has_what_is_left_of_the_study(left: float | None) -> None:
    """Not of the stage, whatever the stage says."""
    bar = Shown()

    @contextmanager
    def bars(_what: str, _counted: str) -> Iterator[Shown]:
        yield bar

    with bars_with_left(bars, lambda: left)("settings", "runs") as opened:
        opened.update(3.0, 10.0, 7.0)
    assert bar.updates == [(3.0, 10.0, left)]


def test_the_bound_counts_all_phases_and_never_grows() -> None:
    """Measuring occupies both processors, a long run one. Of 100 s each, 40 s are measured."""
    left = TimeLeft(Effort(budget=200.0))
    assert left.after_measuring(0.0) == 100.0 + RESERVE
    assert left.after_measuring(40.0) == left.after_runs(0.0) == 60.0 + RESERVE
    assert left.after_runs(50.0) == 35.0 + RESERVE
    # The next phase has some of these runs again, and starts to count them from 0.
    assert left.after_runs(20.0) == 35.0 + RESERVE
    assert left.after_runs(60.0) == 30.0 + RESERVE


def test_a_phase_that_needs_less_lowers_the_bound_for_good() -> None:
    left = TimeLeft(Effort(budget=200.0))
    left.after_runs(20.0)
    left.at_most(15.0)
    assert left.after_runs(20.0) == 15.0
    left.at_most(50.0)
    assert left.after_runs(24.0) == 13.0


def test_no_bound_is_stated_beyond_the_limit() -> None:
    left = TimeLeft(Effort(budget=0.0))
    assert left.after_measuring(RESERVE - 1.0) == 1.0
    assert left.after_measuring(RESERVE + 1.0) is None
    assert left.after_runs(0.0) is None


def test_the_limit_is_what_is_promised() -> None:
    assert DEFAULT.limit == 300.0
    assert THOROUGH.limit <= 3600.0

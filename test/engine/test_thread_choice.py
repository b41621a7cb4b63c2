# SPDX-License-Identifier: Apache-2.0
"""Choice of threads by the durations of ticks, which are given here instead of measured."""

from collections.abc import Callable

import pytest

from conveyor_sim.engine.threads.thread_choice import LEAST_WORK, ThreadChoice

ONE = 3e-3
"""Duration of a tick on one thread, s."""


def play(choice: ThreadChoice, ticks: int, seconds: Callable[[int], float]) -> tuple[float, list[int]]:
    """Let ticks pass that take seconds(threads); return their total in s, and the threads of each."""
    total, sizes = 0.0, []
    for _ in range(ticks):
        size = choice.size
        sizes.append(size)
        total += seconds(size)
        choice.took(seconds(size), 1.0)
    return total, sizes


def test_more_threads_are_taken_where_they_are_faster() -> None:
    """With nearly the full gain of four cores, all four are in use within a few dozen ticks, and stay so."""
    _, sizes = play(ThreadChoice(4), 300, lambda size: ONE / size**0.9)
    assert sizes[0] == 1
    assert sizes[60:].count(4) > 0.9 * len(sizes[60:])


@pytest.mark.parametrize("slower", [1.0, 1.5, 4.0])
def test_a_busy_second_core_costs_less_than_a_tenth(slower: float) -> None:
    """Two threads are no faster, or up to 4 times slower: with trials, 1000 ticks take at most 10 % longer."""
    total, sizes = play(ThreadChoice(2), 1000, lambda size: ONE * (slower if size == 2 else 1.0))
    assert total < 1.1 * 1000 * ONE
    assert 1 <= sizes.count(2) <= 20


def test_a_core_that_gets_busy_is_left_and_taken_again_once_free() -> None:
    choice = ThreadChoice(2)
    free, busy = {1: ONE, 2: 0.55 * ONE}, {1: ONE, 2: 4.0 * ONE}
    play(choice, 100, free.__getitem__)
    assert choice.size == 2
    total, sizes = play(choice, 400, busy.__getitem__)
    assert total < 1.1 * 400 * ONE
    assert sizes[5:].count(2) <= 12
    _, sizes = play(choice, 800, free.__getitem__)
    assert sizes[-1] == 2


def test_little_work_stays_on_one_thread() -> None:
    """Waking a second thread would cost more than it saves, so it is not tried."""
    _, sizes = play(ThreadChoice(8), 500, lambda size: 0.9 * LEAST_WORK / size)
    assert set(sizes) == {1}


def test_one_core_has_no_choice() -> None:
    _, sizes = play(ThreadChoice(1), 50, lambda _: ONE)
    assert set(sizes) == {1}


def test_three_cores() -> None:
    """The number is no power of two: 1, 2 and 3 can be chosen."""
    _, sizes = play(ThreadChoice(3), 200, lambda size: ONE / size)
    assert set(sizes) <= {1, 2, 3}
    assert sizes[-1] == 3

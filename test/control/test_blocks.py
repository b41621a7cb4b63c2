# SPDX-License-Identifier: Apache-2.0
"""Function blocks by the timing diagrams of IEC 61131-3, in scans of 0.1 s."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from conveyor_sim.control.blocks import COVERED, CTU, F_TRIG, HYSTERESIS, R_TRIG, RAMP, RS, SR, TOF, TON, TP, limit


def timed(block: Callable[[bool, float], bool], drawn: str) -> str:
    """Return Q over scans, drawn as IN is: # on, . off."""
    return "".join(".#"[block(mark == "#", 0.1 * scan)] for scan, mark in enumerate(drawn))


def traced(block: Callable[[bool], bool], drawn: str) -> str:
    return "".join(".#"[block(mark == "#")] for mark in drawn)


@pytest.mark.parametrize(
    ("block", "in_", "q"),
    [
        (TON(0.3), "..######..###.", ".....###......"),
        (TON(0.0), ".##.#", ".##.#"),
        (TOF(0.3), "..##......#.#.....", "..#####...######.."),
        (TOF(0.0), ".##.#", ".##.#"),
        (TP(0.3), "..######..#......", "..###.....###...."),
        (TP(0.3), ".#.#.#.#..", ".###.###.."),
        (COVERED(0.3, 0.2), ".##.#####.#..##...", ".......##########."),
    ],
)
def test_timers(block: Callable[[bool, float], bool], in_: str, q: str) -> None:
    assert timed(block, in_) == q


def test_a_timer_tells_how_long_it_has_been_on() -> None:
    timer = TON(0.25)
    for time, elapsed in ((1.0, 0.0), (1.1, 0.1), (1.2, 0.2), (1.3, 0.25)):
        timer(True, time)
        assert timer.et == pytest.approx(elapsed)
    timer(False, 1.4)
    assert timer.et == 0.0


def test_edges() -> None:
    assert traced(R_TRIG(), "#.##.#") == "#.#..#"
    assert traced(F_TRIG(), "..##.#.") == "....#.#"


def test_flip_flops_differ_where_both_are_on() -> None:
    steps = ((False, False), (True, False), (False, False), (True, True), (False, True), (True, True))
    sr, rs = SR(), RS()
    assert [sr(set_, reset) for set_, reset in steps] == [False, True, True, True, False, True]
    assert [rs(set_, reset) for set_, reset in steps] == [False, True, True, False, False, False]


def test_a_counter_counts_rising_edges() -> None:
    counter = CTU(2)
    assert [counter(mark == "#", False) for mark in ".##.#.#"] == [False] * 4 + [True] * 3
    assert counter.cv == 3
    assert not counter(True, True) and counter.cv == 0


def test_hysteresis_keeps_what_was() -> None:
    block = HYSTERESIS(low=2.0, high=5.0)
    assert [block(value) for value in (3, 5, 3, 2, 3, 4.9, 7, 2.1)] == [
        False,
        True,
        True,
        False,
        False,
        False,
        True,
        True,
    ]


def test_a_ramp_follows_at_its_rate() -> None:
    ramp = RAMP(rate=2.0, start=1.0)
    assert [ramp(target, 0.1) for target in (1.5, 1.5, 1.5, 1.5, 1.45, 0.0)] == pytest.approx(
        [1.2, 1.4, 1.5, 1.5, 1.45, 1.25]
    )


def test_limit() -> None:
    assert [limit(-1.0, value, 2.0) for value in (-3.0, 0.5, 9.0)] == [-1.0, 0.5, 2.0]

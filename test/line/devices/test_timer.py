"""On-delays and off-delays, in simulated time."""

from __future__ import annotations

from conveyor_sim.line.devices.timer import Timer


def test_a_timer_ignores_what_is_too_short_and_keeps_exact_times() -> None:
    timer = Timer(on=0.03, off=0.05)
    timer.start(False)
    short, long = [(0.10, True), (0.12, False)], [(0.20, True), (0.23, False)]
    assert timer.follow(short, 0.19) == []
    assert timer.follow(long[:1], 0.229) == []
    assert timer.follow([], 0.23) == [(0.23, True)]
    assert timer.follow(long[1:], 0.25) == []
    # A pulse exactly as long as the delay counts; one that ends as late as it would ripen still lets it ripen first.
    assert timer.follow([(0.26, True), (0.27, False)], 0.31) == []
    assert timer.follow([], 0.4) == [(0.32, False)]
    at_once = Timer(0.0, 0.0)
    assert at_once.follow([(0.5, True), (0.5, False), (0.7, True)], 1.0) == [(0.5, True), (0.5, False), (0.7, True)]

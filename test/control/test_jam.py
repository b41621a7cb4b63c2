# SPDX-License-Identifier: Apache-2.0
"""Jam alarm and clearing, by tables of scans."""

from __future__ import annotations

import pytest
from control.scans import Scans
from facts import stating

from conveyor_sim.control import ControlError
from conveyor_sim.control.jam import JamAlarm, JamClearing

SPEED, COUNT, WAIT, TAKES = "belts/exit/speed", "counters/exit/forward", "photo_eyes/wait/blocked", "machines/m/running"
COMMAND, ALARM, IN_VAIN = "belts/exit/cmd_speed", "alarms/jam at exit", "alarms/jam at exit not cleared"
JAMMED = {SPEED: 0.3, COUNT: 7.0, WAIT: 1.0, TAKES: 1.0}


def alarm() -> JamAlarm:
    return JamAlarm("exit", "exit", (COUNT, "machines/m/taken"), WAIT, time=3.0, takes=TAKES)


def alarm_scans() -> Scans:
    return Scans(alarm(), **JAMMED, **{"machines/m/taken": 0.0})


def test_no_passage_while_bottles_wait_and_the_belt_runs_is_a_jam() -> None:
    assert alarm_scans().until(ALARM, 1.0, 4.0) == pytest.approx(3.0)


@pytest.mark.parametrize("without", [{SPEED: 0.0}, {WAIT: 0.0}, {TAKES: 0.0}])
def test_else_it_is_none(without: dict[str, float]) -> None:
    assert alarm_scans().hold(600.0, without) == {ALARM: 0.0}


@pytest.mark.parametrize("count", [COUNT, "machines/m/taken"])
def test_a_queue_that_moves_on_is_none(count: str) -> None:
    scans = alarm_scans()
    assert all(scans.hold(2.9, {count: 8.0 + number}) == {ALARM: 0.0} for number in range(200))


def test_the_alarm_stands_until_a_bottle_passes() -> None:
    scans = alarm_scans()
    scans.hold(3.1)
    answers = scans.table([(10.0, {SPEED: 0.0}), (1.0, {WAIT: 0.0}), (0.01, {COUNT: 8.0}), (10.0, {})])
    assert [answer[ALARM] for answer in answers] == [1.0, 1.0, 0.0, 0.0]


@pytest.fixture
def clearing() -> Scans:
    hold = {"belts/feeder/cmd_speed": 0.0}
    times = {"stop_time": 0.5, "back_time": 1.0, "jog_time": 2.0}
    controller = JamClearing(alarm(), **times, back_speed=-0.05, jog_speed=0.1, tries=2, hold=hold)
    return Scans(controller, **JAMMED, **{"machines/m/taken": 0.0})


def trace(scans: Scans, seconds: float, count: float) -> list[tuple[float, float | None]]:
    """Scan without a passage, and return the phases as durations and belt speeds."""
    runs: list[tuple[float, float | None]] = []
    for _ in range(round(seconds / 0.01)):
        speed = scans.scan({COUNT: count}).get(COMMAND)
        if runs and runs[-1][1] == speed:
            runs[-1] = (round(runs[-1][0] + 0.01, 2), speed)
        else:
            runs.append((0.01, speed))
    return runs


def test_it_stops_backs_and_jogs_and_gives_up_after_its_tries(clearing: Scans) -> None:
    one_try = [(0.5, 0.0), (1.0, -0.05), (2.0, 0.1)]
    assert trace(clearing, 13.0, 7.0) == [(3.0, None), *one_try, *one_try, (3.0, 0.0)]
    assert clearing.scan({}) == {ALARM: 1.0, IN_VAIN: 1.0, COMMAND: 0.0, "belts/feeder/cmd_speed": 0.0}


def test_it_answers_no_commands_before_a_jam(clearing: Scans) -> None:
    assert clearing.hold(2.0) == {ALARM: 0.0, IN_VAIN: 0.0}


def test_a_passage_in_the_jog_ends_it(clearing: Scans) -> None:
    trace(clearing, 3.0 + 0.5 + 1.0 + 1.2, 7.0)
    assert clearing.scan({COUNT: 8.0}) == {ALARM: 0.0, IN_VAIN: 0.0}
    again = trace(clearing, 13.0, 8.0)
    assert again[0] == (3.0, None) and again[-1] == (3.0, 0.0)  # the next jam has all its tries


def test_a_count_that_goes_on_while_it_backs_ends_nothing(clearing: Scans) -> None:
    trace(clearing, 3.0 + 0.5 + 0.2, 7.0)
    assert clearing.scan({COUNT: 8.0})[COMMAND] == -0.05
    assert trace(clearing, 3.0, 8.0) == [(0.79, -0.05), (2.0, 0.1), (0.21, 0.0)]


def test_help_ends_what_it_could_not_clear(clearing: Scans) -> None:
    trace(clearing, 12.0, 7.0)
    assert clearing.scan({COUNT: 8.0}) == {ALARM: 0.0, IN_VAIN: 0.0}


def test_speeds_of_the_wrong_sign_are_refused() -> None:
    with pytest.raises(ControlError, match=stating("back_speed, jog_speed", "0.1 and 0.1", "below 0", "above 0")):
        JamClearing(alarm(), back_speed=0.1)

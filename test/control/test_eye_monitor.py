# SPDX-License-Identifier: Apache-2.0
"""Plausibility checks of a photo-eye: bottles on a belt by kinematics, and faults of the eye."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from control.scans import LENGTH, Beam, Scans, edges_of
from facts import stating

from conveyor_sim.control import ControlError
from conveyor_sim.control.eye_monitor import EyeMonitor

DIAMETER, SPEED, APART = 0.06, 0.3, 0.5  # m, m/s, m between the eyes
ON, OFF, CHATTERS = (f"alarms/here {what}" for what in ("stuck on", "stuck off", "chatters"))
HOLD = "belts/feeder/cmd_speed"
QUIET = {ON: 0.0, OFF: 0.0, CHATTERS: 0.0}
Fault = Callable[[dict[str, float]], None]


class Row:
    """Bottles with a pitch (m) that pass two eyes, 0.5 m apart."""

    def __init__(self, pitch: float, **parameters: object) -> None:
        given = {"hold": {HOLD: 0.0}, "next_eye": "next", "next_after": APART, **parameters}
        self.here, self.next = Beam("here"), Beam("next")
        self.scans = Scans(EyeMonitor("here", "belt", DIAMETER, **given))  # type: ignore[arg-type]
        self.travel = 0.0
        fronts = [0.01 + pitch * number for number in range(400)]
        self._edges = (edges_of(fronts, DIAMETER), edges_of([front + APART for front in fronts], DIAMETER))

    def run(self, seconds: float, speed: float = SPEED, works: tuple[bool, bool] = (True, True)) -> dict[str, float]:
        """Return the last answer. A faulty eye keeps its signals."""
        answer: dict[str, float] = {}
        for _ in range(round(seconds / LENGTH)):
            answer = self._scan(speed, works)
        return answer

    def until(self, alarm: str, seconds: float, works: tuple[bool, bool] = (True, True)) -> float:
        """Return the time until the alarm stands alone and the line is held, s."""
        for number in range(round(seconds / LENGTH)):
            answer = self._scan(SPEED, works)
            if HOLD in answer:
                assert answer == {**QUIET, alarm: 1.0, HOLD: 0.0}
                return number * LENGTH
        raise AssertionError(f"no alarm within {seconds:g} s")

    def _scan(self, speed: float, works: tuple[bool, bool]) -> dict[str, float]:
        time, before = self.scans.time, self.travel
        self.travel += speed * LENGTH
        for beam, edges, well in zip((self.here, self.next), self._edges, works, strict=True):
            if well and speed:
                beam.pass_by(edges, before, self.travel, time, LENGTH)
        return self.scans.scan({"belts/belt/speed": speed, **self.here.signals(), **self.next.signals()})


@pytest.mark.parametrize("pitch", [DIAMETER + 0.001, 0.1, 0.7])
def test_bottles_raise_nothing_as_they_come_stop_and_go(pitch: float) -> None:
    row = Row(pitch)
    for _ in range(4):
        assert row.run(5.0) == QUIET
        assert row.run(3.0, speed=0.0) == QUIET


def test_blocked_while_the_belt_moves_on_is_stuck_on() -> None:
    row = Row(0.1)
    row.run(1.1)
    assert row.run(0.01)[ON] == 0.0 and row.here.signals()["photo_eyes/here/blocked"]
    assert row.until(ON, 2.0, works=(False, True)) == pytest.approx(5 * DIAMETER / SPEED, abs=0.2)
    # A line that is held moves no more; the eye itself ends the alarm.
    assert row.run(10.0, speed=0.0)[ON] == 1.0
    row.here.toggle(row.scans.time)
    assert row.run(0.02, speed=0.0) == QUIET


def test_blocked_in_a_queue_is_not() -> None:
    row = Row(0.1, queue="zones/z/full")
    row.scans.hold(0.01, {"zones/z/full": 1.0, "belts/belt/speed": 0.0, **row.here.signals(), **row.next.signals()})
    row.run(1.11)
    assert row.run(20.0, works=(False, True))[ON] == 0.0


def test_bottles_that_only_the_next_eye_sees_mean_stuck_off() -> None:
    row = Row(0.15)
    row.run(3.0)
    while row.here.signals()["photo_eyes/here/blocked"]:
        row.run(0.01)
    # Those on the way come by first, then `missed` more; 0.1 s for what the eye had just seen.
    assert row.until(OFF, 5.0, works=(False, True)) == pytest.approx((APART + 3 * 0.15) / SPEED, abs=0.5)
    assert row.run(10.0, speed=0.0)[OFF] == 1.0
    row.here.toggle(row.scans.time)
    assert row.run(0.02, speed=0.0) == QUIET


def test_an_eye_past_which_nothing_comes_is_not() -> None:
    row = Row(0.15)
    row.run(3.0)
    assert row.run(20.0, works=(False, False))[OFF] == 0.0


@pytest.mark.parametrize("frequency", [10.0, 25.0])
def test_more_edges_than_bottles_make_are_chatter(frequency: float) -> None:
    row = Row(0.15)
    row.run(3.0)
    start = row.scans.time
    for _ in range(100):
        row.here.toggle(row.scans.time)
        answer = row.run(0.5 / frequency, works=(False, True))
        if HOLD in answer:
            break
    assert answer == {**QUIET, CHATTERS: 1.0, HOLD: 0.0}
    assert row.scans.time - start < 1.5
    assert row.run(1.1, speed=0.0)[CHATTERS] == 0.0


def test_when_the_next_eye_chatters_this_one_is_not_stuck_off() -> None:
    row = Row(0.7)
    row.run(3.0)
    for _ in range(400):
        row.next.toggle(row.scans.time)
        assert row.run(0.02, works=(True, False))[OFF] == 0.0


def test_without_a_next_eye_none_is_looked_for() -> None:
    controller = EyeMonitor("here", "belt", DIAMETER)
    scans = Scans(controller, **{"belts/belt/speed": SPEED}, **Beam("here").signals())
    assert scans.hold(5.0) == QUIET


def test_the_distance_to_the_next_eye_is_needed() -> None:
    with pytest.raises(ControlError, match=stating("next_after", "0 m", "distance", "above 0")):
        EyeMonitor("here", "belt", DIAMETER, next_eye="next")

# SPDX-License-Identifier: Apache-2.0
"""Cascade stop and start of three belts in a row."""

from __future__ import annotations

import pytest
from control.scans import Scans

from conveyor_sim.control.cascade import Cascade, CascadeZone

NAMES = ("a", "b", "c")  # downstream
TAKES = "machines/packer/running"


def eye(name: str) -> str:
    return f"photo_eyes/{name}/blocked"


def speed(name: str) -> str:
    return f"belts/{name}/cmd_speed"


@pytest.fixture
def scans() -> Scans:
    zones = tuple(CascadeZone(name, name, 0.3) for name in NAMES)
    controller = Cascade(zones, TAKES, full_delay=1.0, clear_delay=0.2, start_delay=0.7)
    return Scans(controller, **{eye(name): 0.0 for name in NAMES}, **{TAKES: 1.0})


def running(answer: dict[str, float]) -> str:
    return "".join(name for name in NAMES if answer[speed(name)] == 0.3)


def test_bottles_on_their_way_stop_nothing(scans: Scans) -> None:
    eyes = [{eye(name): blocked for name in NAMES} for blocked in (1.0, 0.0)]
    assert [running(answer) for answer in scans.table([(0.9, eyes[0]), (0.3, eyes[1])] * 3)] == ["abc"] * 6


def test_zones_stop_as_they_fill_each_after_its_delay(scans: Scans) -> None:
    assert running(scans.hold(5.0, {TAKES: 0.0})) == "abc"  # there is room yet
    assert scans.until(speed("c"), 0.0, 2.0, {eye("c"): 1.0}) == pytest.approx(1.0)
    assert running(scans.hold(5.0)) == "ab"
    assert scans.until(speed("b"), 0.0, 2.0, {eye("b"): 1.0}) == pytest.approx(1.0)
    assert scans.until(speed("a"), 0.0, 2.0, {eye("a"): 1.0}) == pytest.approx(1.0)
    assert running(scans.hold(0.1)) == ""


def test_each_starts_when_the_next_one_has_room(scans: Scans) -> None:
    full = {eye(name): 1.0 for name in NAMES}
    scans.hold(2.0, {TAKES: 0.0, **full})
    assert scans.until(speed("c"), 0.3, 2.0, {TAKES: 1.0}) == pytest.approx(0.7)
    assert running(scans.hold(5.0)) == "c"  # it is full yet
    # Free for 0.2 s, and then room for 0.7 s.
    assert scans.until(speed("b"), 0.3, 2.0, {eye("c"): 0.0}) == pytest.approx(0.9)
    assert scans.until(speed("a"), 0.3, 2.0, {eye("b"): 0.0}) == pytest.approx(0.9)
    assert running(scans.hold(5.0)) == "abc"


def test_it_stops_again_when_the_next_one_is_full_again(scans: Scans) -> None:
    scans.hold(2.0, {TAKES: 0.0, **{eye(name): 1.0 for name in NAMES}})
    assert running(scans.hold(2.0, {TAKES: 1.0, eye("c"): 0.0})) == "bc"
    assert scans.until(speed("b"), 0.0, 2.0, {eye("c"): 1.0}) == pytest.approx(1.0)
    assert running(scans.hold(2.0)) == "c"


def test_a_zone_that_got_room_runs_although_nothing_is_taken(scans: Scans) -> None:
    scans.hold(2.0, {TAKES: 0.0, **{eye(name): 1.0 for name in NAMES}})
    assert scans.until(speed("b"), 0.3, 1.0, {eye("b"): 0.0}) == pytest.approx(0.2)
    assert running(scans.hold(0.6)) == "b"
    assert running(scans.hold(0.2)) == "ab"  # b has room for what a holds


def test_a_short_release_does_not_start_the_row(scans: Scans) -> None:
    scans.hold(2.0, {TAKES: 0.0, **{eye(name): 1.0 for name in NAMES}})
    answers = scans.table([(0.6, {TAKES: 1.0}), (0.1, {TAKES: 0.0})] * 4)
    assert [running(answer) for answer in answers] == [""] * 8

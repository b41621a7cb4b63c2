# SPDX-License-Identifier: Apache-2.0
"""Level control of a table, by tables of scans."""

from __future__ import annotations

import pytest
from control.scans import Scans
from facts import stating

from conveyor_sim.control import ControlError
from conveyor_sim.control.level import Count, Counters, Eyes, Level, LevelControl
from conveyor_sim.control.load import load

FEEDER, TABLE = "belts/in/cmd_speed", "belts/table/cmd_speed"


def control(level: Level, high: float, low: float) -> LevelControl:
    return LevelControl(level, "in", "table", high, low, feeder_speed=1.0, table_slow=0.2, table_fast=0.3)


def test_from_a_count_the_feeder_is_held_between_the_marks_and_the_table_runs_fast_up_to_the_low_one() -> None:
    scans = Scans(control(Count("zones/table/bottles"), high=45, low=35))
    rows = (
        (0, 1.0, 0.3),
        (35, 1.0, 0.3),
        (36, 1.0, 0.2),
        (44, 1.0, 0.2),
        (45, 0.0, 0.2),
        (36, 0.0, 0.2),
        (35, 1.0, 0.3),
    )
    for bottles, feeder, table in rows:
        assert scans.scan({"zones/table/bottles": bottles}) == {FEEDER: feeder, TABLE: table}


def test_the_controller_of_the_papers_plant_counts_the_bottles_on_its_table() -> None:
    """It is loaded by name, as a node does. Other belts, marks and speeds are parameters."""
    scans = Scans(load("conveyor_sim.control.level:table_level"))
    for bottles, feeder, table in ((44, 1.0, 0.2), (45, 0.0, 0.2), (36, 0.0, 0.2), (35, 1.0, 0.3)):
        answer = scans.scan({"belts/table/bottles": bottles})
        assert answer == {"belts/feeder/cmd_speed": feeder, "belts/table/cmd_speed": table}
    other = Scans(load("conveyor_sim.control.level:table_level", {"feeder": "in", "high_mark": 5, "low_mark": 4}))
    assert other.scan({"belts/table/bottles": 5})[FEEDER] == 0.0
    with pytest.raises(ControlError, match=stating("high", "5", "low", "35")):
        load("conveyor_sim.control.level:table_level", {"high_mark": 5})


def test_from_counters_the_level_is_what_came_less_what_went() -> None:
    level = Counters(("counters/a/forward", "counters/b/forward"), ("counters/out/forward",), at_start=5)
    scans = Scans(control(level, high=10, low=6))
    for a, b, out, feeder in ((0, 0, 0, 1.0), (3, 1, 0, 1.0), (3, 2, 0, 0.0), (9, 2, 9, 0.0), (9, 2, 10, 1.0)):
        counts = {"counters/a/forward": a, "counters/b/forward": b, "counters/out/forward": out}
        assert scans.scan(counts)[FEEDER] == feeder


def test_from_eyes_only_bottles_that_stand_count() -> None:
    scans = Scans(control(Eyes(("low", "high"), on=0.5, off=0.3), high=2, low=0))
    low, high = "photo_eyes/low/blocked", "photo_eyes/high/blocked"
    passing = [(0.3, {low: 1, high: 1}), (0.2, {low: 0, high: 0})] * 5
    assert all(answer == {FEEDER: 1.0, TABLE: 0.3} for answer in scans.table(passing))
    rows = [
        ({low: 1}, 0.55, 1.0, 0.2),  # up to the low eye
        ({high: 1}, 0.45, 1.0, 0.2),
        ({}, 0.1, 0.0, 0.2),  # up to the high eye
        ({high: 0}, 2.0, 0.0, 0.2),
        ({low: 0}, 0.25, 0.0, 0.2),
        ({}, 0.1, 1.0, 0.3),
    ]
    for signals, seconds, feeder, table in rows:
        assert scans.hold(seconds, signals) == {FEEDER: feeder, TABLE: table}


def test_marks_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ControlError, match=stating("high", "3", "low", "4")):
        control(Count("zones/table/bottles"), high=3, low=4)

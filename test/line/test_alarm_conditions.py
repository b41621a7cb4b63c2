# SPDX-License-Identifier: Apache-2.0
"""Alarms on measured values: limits and deadband."""

import math
from collections.abc import Sequence
from typing import Any

import pytest
from facts import missing
from line.alarms.board import SIGNALS, Board

from conveyor_sim.line.alarm_system import MeasuredConditions
from conveyor_sim.line.device import Device
from conveyor_sim.line.tag import count, number

NOW: Any = None  # these devices don't look


class Shown(Device):
    """Provider with settable values that counts how often it is read."""

    def __init__(self, signal: str) -> None:
        other = count(f"{signal}_before", "counter", "Comes before it.")
        super().__init__("shown", [other, number(signal, "actual", "What is shown.", "1", 0.0, 100.0)])
        self.value = 0.0
        self.looks = 0

    def values(self, now: Any) -> Sequence[float]:
        self.looks += 1
        return 77.0, self.value


def seen(fields: dict[str, Any], values: Sequence[float]) -> list[bool]:
    """Return whether the alarm is active after each value, one tick per value."""
    board, device = Board(it={"tag": SIGNALS[0], **fields}), Shown(SIGNALS[0])
    measured, found = MeasuredConditions(board.alarms, [device, Shown(SIGNALS[1])]), []
    for device.value in values:
        board.tick += 1
        board.say(**measured.changes(NOW, {}))
        board.alarms.end(board.tick)
        found.append(board.alarms["it"].active)
    return found


@pytest.mark.parametrize(
    ("fields", "values", "active"),
    [
        ({"high": 40.0}, [40.0, 40.1, 40.0, 39.0], [0, 1, 0, 0]),
        ({"high": 40.0, "deadband": 5.0}, [36.0, 41.0, 40.0, 35.1, 35.0, 39.0], [0, 1, 1, 1, 0, 0]),
        ({"low": 10.0, "deadband": 2.0}, [10.0, 9.9, 11.0, 12.0, 10.5], [0, 1, 1, 0, 0]),
        ({"low": 10.0, "high": 20.0, "deadband": 1.0}, [15.0, 21.0, 19.5, 9.0, 10.5, 11.0], [0, 1, 1, 1, 1, 0]),
        ({"high": 1.0, "on_delay": 0.2, "off_delay": 0.1}, [2, 2, 2, 0, 0, 2, 0], [0, 0, 1, 1, 0, 0, 0]),
        ({"high": 1.0}, [math.nan, 2.0, math.nan, math.inf, 0.0, -math.inf, math.nan], [0, 1, 1, 1, 0, 0, 0]),
        ({}, [2.0, 2.0], [0, 0]),
    ],
)
def test_limits(fields: dict[str, Any], values: list[float], active: list[int]) -> None:
    assert seen(fields, values) == [bool(one) for one in active]


def test_only_devices_with_alarms_are_looked_at_each_once() -> None:
    board, one, other = Board(), Shown(SIGNALS[0]), Shown(SIGNALS[1])
    measured = MeasuredConditions(board.alarms, [one, other])
    assert measured.changes(NOW, {}) == {}
    assert one.looks == other.looks == 0
    board.declare(a={"tag": SIGNALS[1], "high": 1.0}, b={"tag": SIGNALS[1], "high": 3.0})  # later, by a controller
    other.value = 2.0
    for _ in range(10):
        board.say(**measured.changes(NOW, {}))
    assert (one.looks, other.looks) == (0, 10)
    assert board.states() == {"a": "UNACKNOWLEDGED", "b": "NORMAL"}
    board.declare(a={})
    assert missing(board.alarms.value_problem("b"), "alarms/b", "`high`", "`low`") == []
    assert board.alarms.value_problem("a") == "" == board.alarms.value_problem("c")

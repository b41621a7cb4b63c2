# SPDX-License-Identifier: Apache-2.0
"""Alarms that the scan loop gives to the line."""

from __future__ import annotations

from conveyor_sim.run.alarm_changes import AlarmChanges


def test_only_alarms_that_change_are_given_to_the_line() -> None:
    changes = AlarmChanges()
    changing = [
        changes.of(answer)
        for answer in (
            {"alarms/a": 0.0, "alarms/b": True, "belts/x/cmd_speed": 1.0},
            {"alarms/a": 0.0, "alarms/b": 1.0},
            {"alarms/a": 1.0},
            {},
        )
    ]
    assert changing == [
        {"alarms/a": 0.0, "alarms/b": 1.0},
        {},
        {"alarms/a": 1.0, "alarms/b": 0.0},
        {"alarms/a": 0.0},
    ]

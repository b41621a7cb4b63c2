# SPDX-License-Identifier: Apache-2.0
"""Combined controllers."""

from __future__ import annotations

from typing import Any

import pytest
from control.scans import Scans

from conveyor_sim.control import Constant, ControlError, Inputs, priority, together
from conveyor_sim.control.scan import commands_of
from conveyor_sim.run.alarm_changes import AlarmChanges


def test_together_merges_what_all_answer() -> None:
    both = together(Constant({"belts/a/cmd_speed": 0.5}), Constant({"alarms/jam": 1.0, "gates/g/open": 0.0}))
    assert Scans(both).scan({}) == {"belts/a/cmd_speed": 0.5, "alarms/jam": 1.0, "gates/g/open": 0.0}


def test_together_refuses_two_that_command_the_same() -> None:
    with pytest.raises(ControlError, match=r"belts/a/cmd_speed: sent by both Constant and Constant in one scan"):
        Scans(together(Constant({"belts/a/cmd_speed": 0.5}), Constant({"belts/a/cmd_speed": 0.5}))).scan({})


def test_the_earlier_has_priority_and_the_later_is_scanned_too() -> None:
    class Counts:
        scans = 0

        def scan(self, inputs: Inputs) -> dict[str, float]:
            self.scans += 1
            return {"belts/a/cmd_speed": 0.5, "belts/b/cmd_speed": 0.3}

    behind = Counts()
    scans = Scans(priority(Constant({"belts/a/cmd_speed": 0.0}), behind))
    assert [scans.scan({}) for _ in range(3)] == [{"belts/a/cmd_speed": 0.0, "belts/b/cmd_speed": 0.3}] * 3
    assert behind.scans == 3


def test_inputs_tell_bools_and_what_is_missing() -> None:
    inputs = Inputs({"photo_eyes/a/blocked": 1.0, "photo_eyes/b/blocked": 0.0}, 0.0, 0, 0.01)
    assert (inputs.on("photo_eyes/a/blocked"), inputs.on("photo_eyes/b/blocked")) == (True, False)
    assert inputs.get("belts/a/speed") is None
    with pytest.raises(ControlError, match=r"^photo_eyes/c/blocked: no such signal.* photo_eyes/a/blocked, ph"):
        inputs["photo_eyes/c/blocked"]
    with pytest.raises(KeyError, match="which has no zones/"):
        inputs["zones/z/bottles"]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "scan: None returned, expected a mapping of commands"),
        ([1.0], "scan: [1.0] returned, expected a mapping of commands"),
        ({5: 1.0}, "scan: 5 returned as a name, expected that of a command or an alarm"),
        ({"gates/g/open": "x"}, "gates/g/open: 'x' answered by the controller, expected a number"),
        ({"gates/g/open": None}, "gates/g/open: None answered by the controller, expected a number"),
        ({"alarms/jam": None}, "alarms/jam: None answered by the controller, expected a number"),
    ],
)
def test_what_is_no_answer_is_said(answer: Any, message: str) -> None:
    with pytest.raises(ControlError) as raised:
        AlarmChanges().with_commands(answer)
    assert str(raised.value) == message


def test_commands_are_numbers_without_the_alarms() -> None:
    assert commands_of({"gates/g/open": True, "alarms/jam": 1.0}) == {"gates/g/open": 1.0}

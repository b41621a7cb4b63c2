# SPDX-License-Identifier: Apache-2.0
"""Declarations of alarms by controllers."""

import json
from typing import Any

import pytest
from control.test_jam import alarm
from facts import stating

from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.control import Alarm, Constant, ControlError, priority, together
from conveyor_sim.control.jam import JamClearing
from conveyor_sim.control.scan import declared_alarms
from conveyor_sim.scene.parts.alarm import AlarmFields


class Declares:
    """Controller with two alarms."""

    def __init__(self, *alarms: Any) -> None:
        self.declared_alarms = alarms

    def scan(self, inputs: object) -> dict[str, float]:
        return {}


A, B = Alarm("a"), Alarm("b", "B!", latching=True, suppressed_by=["a"])


def test_what_is_as_by_default_does_not_travel() -> None:
    assert A.as_text() == "{}"
    assert json.loads(B.as_text()) == {"text": "B!", "latching": True, "suppressed_by": ["a"]}


def test_the_fields_and_their_defaults_are_those_of_the_line() -> None:
    """All but `confirm`: conveyor_msgs/Alarm, with which controllers declare alarms, has no such field."""
    fields = {name: field for name, field in AlarmFields.model_fields.items() if name != "confirm"}
    assert {"id", *fields} == set(vars(A))
    for name, field in fields.items():
        assert getattr(A, name) == field.default, name


def test_the_fields_are_those_of_the_message() -> None:
    names = {name for name, _ in typestore().fielddefs["conveyor_msgs/msg/Alarm"][1]}
    assert names - {"has_high", "has_low"} == set(vars(A))


def test_one_that_declares_nothing() -> None:
    assert declared_alarms(Constant({})) == ()


@pytest.mark.parametrize("wrong", ["ab", [A, "b"], {"a": A}, 3])
def test_what_is_no_declaration(wrong: Any) -> None:
    controller = Declares()
    controller.declared_alarms = wrong
    with pytest.raises(ControlError, match=stating("Declares.declared_alarms", "list or tuple of Alarm")):
        declared_alarms(controller)


def test_several_together_declare_what_each_does() -> None:
    assert declared_alarms(together(Declares(A), Constant({}), Declares(B))) == (A, B)
    with pytest.raises(ControlError, match=stating("_Together.declared_alarms", "a declared twice")):
        declared_alarms(together(Declares(A), Declares(A)))
    other = Alarm("a", "of the second")
    assert declared_alarms(priority(Declares(A), Declares(other, B))) == (A, B)


def test_shipped_controllers_declare_theirs() -> None:
    ids = [one.id for one in declared_alarms(priority(JamClearing(alarm()), Constant({})))]
    assert ids == ["jam at exit", "jam at exit not cleared"]

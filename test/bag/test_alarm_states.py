# SPDX-License-Identifier: Apache-2.0
"""Alarms are recorded with their states, and replayed without the controller that declared and said them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from bag.editing import edited
from testing.conftest import FEEDER, ON_TABLE, TABLE

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.control import Alarm, Inputs
from conveyor_sim.testing import Scenario


class Level:
    """Says an alarm that it declares, and has the line watch another."""

    declared_alarms = (
        Alarm("one", "a bottle is on the table", "error", latching=True, group="table"),
        Alarm("two", tag=ON_TABLE, high=1.5, on_delay=0.1, group="table", suppressed_by=["one"]),
    )

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {FEEDER: 0.4, "alarms/one": float(inputs[ON_TABLE] == 1)}


def test_states_are_read_back_and_replayed(tmp_path: Path) -> None:
    with Scenario(TABLE, bag=tmp_path / "bag") as table:
        table.attach(Level())
        table.run_until(lambda s: s["alarms/one"], within=10)
        table.simulation.operate("shelve", ["two"], [1.5], writer="anna")
        table.run_until(lambda s: s[ON_TABLE] >= 2, within=10)
        table.run_for(0.5)
        for operation in ("acknowledge", "reset"):
            table.simulation.operate(operation, writer="anna")
        table.run_until(lambda s: s["alarms/two"], within=10)
    with open_bag(tmp_path / "bag") as bag:
        states = [frame.data for frame in bag.read("alarm_states")]
    last, ids = states[-1], list(states[-1].id)
    one, two = ids.index("one"), ids.index("two")
    assert (last.text[one], last.alarm_class[one], last.declared_by[one]) == (
        "a bottle is on the table", "error", "Level",
    )  # fmt: skip
    assert [int(state.state[ids.index("one")]) for state in states if "one" in state.id][-1] == 0
    assert {int(state.state[two]) for state in states if "two" in state.id} >= {0, 1, 6}
    assert last.changed_by[two] == "anna" and last.suppressed_by[two] == ("one",)
    report = replay(tmp_path / "bag")
    assert report.difference is None and report.compared["alarm_states"] == len(states)

    def change(topic: str, message: Any) -> None:
        if topic == "alarm_states" and two < len(message.id) and message.state[two] == 6:
            message.state = np.where(np.arange(len(message.id)) == two, 7, message.state).astype(np.uint8)

    difference = replay(edited(tmp_path / "bag", tmp_path / "changed", change)).difference
    assert difference is not None and (difference.topic, difference.field, difference.part) == (
        "alarm_states", "state", "alarm two",
    )  # fmt: skip

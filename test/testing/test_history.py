"""The history: a value of everything at each tick."""

import numpy as np
import pytest
from testing.conftest import FEEDER, ON_TABLE, PACKER, REMOVED
from testing.test_scenario import Hold

from conveyor_sim.errors import ConveyorError
from conveyor_sim.testing import Scenario
from conveyor_sim.testing.history import Mark


def test_a_row_a_tick(table: Scenario) -> None:
    seen = []
    for _ in range(300):
        table.run_for(0.01)
        seen.append(table.signals["infeeds/lane_1/fed"])
    history = table.history
    assert len(history) == 301
    assert history.time == pytest.approx(np.arange(301) * 0.01)
    assert history["infeeds/lane_1/fed"][1:].tolist() == seen
    assert seen[-1] == 2


def test_it_grows_without_end(table: Scenario) -> None:
    table.run_for(12.0)
    assert len(table.history) == 1201
    assert (np.diff(table.history[REMOVED]) >= 0).all()
    assert table.history[REMOVED][-1] == table.signals[REMOVED]


def test_commands_from_when_they_are_in_force(table: Scenario) -> None:
    table.run_for(0.1)
    table.command(PACKER, 0.0)
    table.run_for(0.1)
    table.command(PACKER, 0.3)
    table.run_for(0.1)
    command, speed = table.history[PACKER], table.history["belts/packer/speed"]
    assert np.isnan(command[:10]).all()
    assert (command[10:20] == 0.0).all() and (command[20:] == 0.3).all()
    # The belt's speed is told at the end of the tick for which it was commanded.
    assert (speed[11:21] == command[10:20]).all() and speed[10] == 0.4
    assert table.history.marks == [Mark(pytest.approx(0.1), PACKER, 0.0), Mark(pytest.approx(0.2), PACKER, 0.3)]


def test_alarms_are_0_before_they_are_first_told_of(table: Scenario) -> None:
    table.run_for(0.5)
    table.attach(Hold(1))
    table.run_until(lambda s: s["alarms/full"], within=10)
    table.run_for(0.1)
    full = table.history["alarms/full"]
    assert full.tolist() == (table.history[ON_TABLE] >= 1).tolist()
    assert table.history[FEEDER][-2] == 0.0
    assert table.history.marks == []  # the controller's commands are none


def test_names_units_and_types(table: Scenario) -> None:
    table.attach(Hold(1))
    table.run_for(0.02)
    history = table.history
    assert {ON_TABLE, FEEDER, "alarms/full"} <= set(history.names)
    assert (history.unit("belts/table/speed"), history.unit(ON_TABLE), history.unit("alarms/full")) == ("m/s", "", "")
    assert (history.kind(FEEDER), history.kind(ON_TABLE), history.kind("alarms/full")) == ("number", "count", "bool")
    with pytest.raises(ConveyorError, match="belts/tabel/speed: not in the history, expected one of belts/feeder"):
        history["belts/tabel/speed"]

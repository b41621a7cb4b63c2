# SPDX-License-Identifier: Apache-2.0
"""The history: a value of everything at each tick."""

import numpy as np
import pytest
from facts import stating
from testing.conftest import FEEDER, ON_TABLE, STOP, TABLE, TAKEN
from testing.test_scenario import Hold

from conveyor_sim.errors import ConveyorError
from conveyor_sim.testing import Scenario

SPEED = "belts/table/cmd_speed"


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
    assert (np.diff(table.history[TAKEN]) >= 0).all()
    assert table.history[TAKEN][-1] == table.signals[TAKEN]


def test_commands_and_faults_from_when_they_are_in_force(table: Scenario) -> None:
    table.run_for(0.1)
    table.command(SPEED, 0.1)
    table.inject(STOP)
    table.run_for(0.1)
    table.command(SPEED, 0.3)
    table.run_for(0.1)
    command, speed = table.history[SPEED], table.history["belts/table/speed"]
    assert np.isnan(command[:10]).all()
    assert (command[10:20] == 0.1).all() and (command[20:] == 0.3).all()
    # The belt reports its speed at the end of the tick for which it was commanded.
    assert (speed[11:21] == command[10:20]).all() and speed[10] == 0.4
    assert table.history[STOP].tolist() == [0.0] * 10 + [1.0] * 21
    marks = [(round(mark.time, 9), mark.name, mark.value) for mark in table.history.marks]
    assert marks == [(0.1, SPEED, 0.1), (0.1, STOP, 1.0), (0.2, SPEED, 0.3)]


def test_alarms_are_0_before_they_are_first_told_of(table: Scenario) -> None:
    table.run_for(0.5)
    table.attach(Hold(1))
    table.run_until(lambda s: s["alarms/full"], within=10)
    table.run_for(0.1)
    full = table.history["alarms/full"]
    assert full.tolist() == [False, *(table.history[ON_TABLE] >= 1).tolist()[:-1]]  # the line has it a tick later
    assert table.history[FEEDER][-2] == 0.0
    assert table.history.marks == []  # the controller's commands are none


def test_names_units_and_types(table: Scenario) -> None:
    table.attach(Hold(1))
    table.run_for(0.02)
    history = table.history
    assert {ON_TABLE, FEEDER, "alarms/full"} <= set(history.names)
    assert (history.unit("belts/table/speed"), history.unit(ON_TABLE), history.unit("alarms/full")) == ("m/s", "", "")
    assert (history.kind(FEEDER), history.kind(ON_TABLE), history.kind("alarms/full")) == ("number", "count", "bool")
    with pytest.raises(ConveyorError, match=stating("belts/tabel/speed", "history", "belts/feeder/speed")):
        history["belts/tabel/speed"]


def test_a_long_run_keeps_the_last_seconds_alone() -> None:
    """A limited history equals the end of an unlimited one at any tick, and does not grow with time."""
    whole, last = (Scenario(TABLE, history=length) for length in (None, 0.5))
    with whole, last:
        for ticks in (20, 29, 1, 1, 48, 51, 100, 333):
            for table in (whole, last):
                table.command(SPEED, 0.1 + 1e-4 * ticks)
                table.run_for(0.01 * ticks)
            kept = min(len(whole.history), 50)
            assert len(last.history) == kept
            np.testing.assert_array_equal(last.history.time, whole.history.time[-kept:])
            for name in (ON_TABLE, SPEED, STOP):
                np.testing.assert_array_equal(last.history[name], whole.history[name][-kept:])
        assert last.history._signals.nbytes < whole.history._signals.nbytes / 5
        last.attach(Hold(1))
        last.run_for(1.0)
        assert len(last.history["alarms/full"]) == 50


def test_a_history_of_no_time_keeps_the_present() -> None:
    with Scenario(TABLE, history=0.0) as table:
        table.run_for(0.05)
        assert table.history.time.tolist() == pytest.approx([0.05])
    with pytest.raises(ValueError, match="expected 0 s or more"):
        Scenario(TABLE, history=-1.0)

# SPDX-License-Identifier: Apache-2.0
"""Operations of operators and engineers in a scenario, and their report."""

from pathlib import Path

import pytest
from testing.conftest import TABLE

from conveyor_sim.control.scan import Constant
from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.inputs import OWN, Input
from conveyor_sim.testing import Scenario

FEEDER, SPEED = "belts/feeder", "belts/feeder/cmd_speed"
EYE = "photo_eyes/high/blocked"


def test_a_controllers_refusals_are_no_error_those_of_a_person_are(table: Scenario) -> None:
    table.attach(Constant({SPEED: 0.3}))
    table.operator.mode(FEEDER, "manual")
    table.operator.set(SPEED, 0.2)
    table.run_for(0.1)
    assert table.history[SPEED][-1] == 0.2
    with pytest.raises(CommandError, match="belts/table: is in Automatic, expected Manual"):
        table.operator.set("belts/table/cmd_speed", 0.1)
    with pytest.raises(CommandError, match="belts/feeder: mode 'off' given, expected one of automatic, maintenance, "):
        table.operator.mode(FEEDER, "off")
    table.command(SPEED, 0.1)  # of the test, accepted in any mode
    table.run_for(0.01)
    assert table.history[SPEED][-1] == 0.1
    table.attach(Constant({SPEED: 99.0, "belts/table/cmd_speed": 99.0}))  # wrong wherever it has control
    with pytest.raises(CommandError, match="belts/table/cmd_speed: 99 given, expected"):
        table.run_for(0.01)


def test_what_was_done_is_marked_and_a_failure_says_what_is_forced(table: Scenario) -> None:
    table.engineer.force(EYE, 1)
    table.engineer.force("belts/feeder/speed", 5)
    table.operator.mode(FEEDER, 3)
    table.run_for(0.01)
    table.operator.unforce("belts/feeder/speed")
    table.run_for(0.01)
    marks = [(mark.name, mark.value) for mark in table.history.marks[:3]]
    assert marks == [(f"{EYE} forced", 1.0), ("belts/feeder/speed forced", 5.0), (f"{FEEDER} mode", 3.0)]
    assert table.history.marks[3].name == "belts/feeder/speed unforced"
    with pytest.raises(AssertionError, match=rf"{EYE} = 1 \(forced\)"):
        table.never(lambda s: s[EYE])


def test_what_a_person_does_to_alarms_and_counters(table: Scenario) -> None:
    table.attach(Constant({"alarms/full": 1.0}))
    table.run_for(0.05)
    full = table.simulation.line.alarms["full"]
    table.operator.acknowledge("full")
    table.run_for(0.01)
    assert (full.state.name, full.changed_by) == ("ACKNOWLEDGED", "operator")
    table.operator.shelve("full", 1.0)
    table.run_for(0.01)
    assert full.state.name == "SHELVED"
    table.engineer.unshelve()
    table.run_for(0.01)
    assert (full.state.name, full.changed_by) == ("UNACKNOWLEDGED", "engineer")  # it comes anew
    with pytest.raises(CommandError, match="remove_from_service: given by operator, expected one of the kind engineer"):
        table.operator.operate("remove_from_service", ["full"])
    with pytest.raises(CommandError, match="full: is unacknowledged, expected one that has latched"):
        table.operator.reset("full")
    table.operator.reset_counters()
    table.run_for(0.01)
    with pytest.raises(CommandError, match="no such alarm"):
        table.operator.acknowledge("ful")


def test_a_checkpoint_of_an_owned_line_has_no_owner_any_more(table: Scenario, tmp_path: Path) -> None:
    """Its controller is not in the checkpoint; the test attaches its own."""
    table.simulation.give(Input("lockstep", "plc", "controller", OWN, (), ()))
    table.run_for(0.01)
    table.simulation.save(tmp_path / "kept.npz")
    with Scenario(TABLE, start=tmp_path / "kept.npz") as later:
        later.attach(Constant({SPEED: 0.3}))
        later.run_for(0.01)
        assert later.history[SPEED][-1] == 0.3 and not later.simulation.line.modes.owner

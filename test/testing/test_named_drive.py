# SPDX-License-Identifier: Apache-2.0
"""Named drives in scenarios: people, faults, controllers of the library, and Structured Text."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import DRIVEN_LINE

from conveyor_sim.control.level import Count, LevelControl
from conveyor_sim.control.st.controller import StructuredText
from conveyor_sim.errors import CommandError
from conveyor_sim.testing import Scenario

SPEED = "drives/m1/cmd_speed"


@pytest.fixture
def line() -> Scenario:
    return Scenario(DRIVEN_LINE)


def test_an_operator_commands_the_drive_but_not_its_belts(line: Scenario) -> None:
    line.operator.mode("drives/m1", "manual")
    line.operator.set(SPEED, 0.4)
    line.run_for(0.5)
    assert line.history["belts/feeder/speed"][-1] == pytest.approx(0.8)
    for act in (
        lambda: line.operator.set("belts/feeder/cmd_speed", 0.1),
        lambda: line.operator.mode("belts/feeder", "automatic"),
        lambda: line.inject("belts/feeder/trip", 1.0),
    ):
        with pytest.raises(CommandError, match="drives/m1 moves this belt"):
            act()


def test_a_trip_stops_its_belts_until_it_is_reset(line: Scenario) -> None:
    line.inject("drives/m1/trip", 1.0)
    line.eventually(lambda s: s["belts/feeder/speed"] == s["belts/table/speed"] == 0.0, within=1.0)
    line.always(lambda s: s["belts/exit/speed"] == 0.3 and s["drives/m1/fault"] == 1.0, for_=0.1)


def test_controllers_of_the_library_command_a_drive(line: Scenario) -> None:
    line.attach(LevelControl(Count("belts/table/bottles"), "drives/m1", "exit", 12, 10, 0.3, 0.2, 0.4))
    line.run_for(0.5)
    assert line.history["belts/feeder/speed"][-1] == pytest.approx(0.6)
    line.eventually(lambda s: s["belts/feeder/speed"] == 0.0, within=60)


def test_a_program_maps_its_variables_to_a_drive(line: Scenario, tmp_path: Path) -> None:
    path = tmp_path / "program.st"
    path.write_text(
        "PROGRAM main VAR_INPUT drives_m1_pulses : LINT; END_VAR VAR_OUTPUT drives_m1_cmd_speed : LREAL; "
        "{tag: drives/m1/run} run : BOOL; END_VAR\n"
        "drives_m1_cmd_speed := 0.5; run := drives_m1_pulses < 200;\nEND_PROGRAM\n"
    )
    line.attach(StructuredText(path))
    line.eventually(lambda s: s["belts/feeder/speed"] > 0.5, within=1.0)
    line.eventually(lambda s: s["drives/m1/running"] == 0.0 and s["belts/feeder/speed"] == 0.0, within=5.0)

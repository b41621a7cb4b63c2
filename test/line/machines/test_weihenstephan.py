# SPDX-License-Identifier: Apache-2.0
"""Data points of the Weihenstephan Standards, derived from tags of machines."""

import re
from pathlib import Path

import pytest
from line.machines.machine_line import END, line, sink, source, station

from conveyor_sim.line.commands.authority import AUTOMATIC, MAINTENANCE, MANUAL
from conveyor_sim.line.commands.inputs import MODE, Input
from conveyor_sim.line.machines.packml import Command, PackMLState
from conveyor_sim.line.machines.stop_reason import (
    BLOCKED,
    COMMANDED,
    FAULT,
    FIRST_FAILURE,
    FIRST_PLANNED,
    NONE,
    STARVED,
)
from conveyor_sim.line.machines.weihenstephan import DATA_POINTS, STATE_TEXTS, data_points, names_of, program, state_of
from conveyor_sim.report.tags import tag_rows
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

PAGE = (Path(__file__).parents[3] / "docs" / "parts" / "data_points.md").read_text()


def points(sim: Simulation, machine: str) -> dict[str, float]:
    image = sim.process_image
    values = dict(zip(image.signal_names, sim.signals(), strict=True))
    values |= dict(zip(image.command_names, sim.line.read_back.values, strict=True))
    return data_points(f"machines/{machine}", {tag.name: tag for tag in image.tags}, values)


def filling() -> Simulation:
    """Return a filler, and a capper that waits for the first bottle."""
    capper = station([[1.0, -0.2], [1.2, -0.2], [1.2, 0.2], [1.0, 0.2]], [1.5, 0.0], suspend_after=0.1)
    lunch = {"lunch": {"start": 2.0, "duration": 1.0}}
    return line(machines={"filler": source(rate_limit=4.0, planned_stops=lunch), "capper": capper}, duration=100.0)


def test_a_machine_that_works() -> None:
    sim = filling()
    sim.command(["machines/filler/rate"], [3.0])
    sim.advance(150)
    assert points(sim, "filler") == {
        "WS_Cur_Mode": 8, "WS_Cur_Prog": 1, "WS_Cur_State": 128, "WS_Cur_Mach_Spd": 3.0, "WS_Set_Mach_Spd": 3.0,
        "WS_Mach_Design_Spd": 2.0, "WS_Not_Of_Fail_Code": 0, "WS_Tot_Containers": 4,
    }  # fmt: skip
    assert points(sim, "capper")["WS_Cur_State"] == 8, "lack"
    sim.advance(350)
    capper = points(sim, "capper")
    assert capper["WS_Tot_Containers"] == capper["WS_Good_Containers"] > 0


def test_why_it_stands() -> None:
    sim = filling()
    sim.inject("machines/filler/stop", 1.0)
    sim.advance()
    failed = points(sim, "filler")
    assert (failed["WS_Cur_State"], failed["WS_Not_Of_Fail_Code"], failed["WS_Cur_Mach_Spd"]) == (1024, FAULT, 0.0)
    sim.inject("machines/filler/stop", 0.0)
    sim.advance(200)
    assert points(sim, "filler")["WS_Cur_Prog"] == 64, "a break"
    assert points(sim, "filler")["WS_Not_Of_Fail_Code"] == 0
    sim.give(Input("operate", "Jo", "engineer", MODE, ("machines/filler",), (float(MAINTENANCE),)))
    sim.advance()
    assert (points(sim, "filler")["WS_Cur_Mode"], points(sim, "filler")["WS_Cur_Prog"]) == (2, 32)


@pytest.mark.parametrize(
    ("state", "reason", "name"),
    [
        (PackMLState.SUSPENDED, STARVED, "Lack"),
        (PackMLState.SUSPENDING, BLOCKED, "Tailback"),
        (PackMLState.UNSUSPENDING, COMMANDED[Command.SUSPEND], "Prepared"),
        (PackMLState.HELD, FIRST_FAILURE, "Equipment failure"),
        (PackMLState.HOLDING, FAULT, "Equipment failure"),
        (PackMLState.HELD, COMMANDED[Command.HOLD], "External failure"),
        (PackMLState.ABORTED, COMMANDED[Command.ABORT], "Emergency stop"),
        (PackMLState.EXECUTE, STARVED, "Operating"),
    ],
)
def test_states_below_those_of_packml(state: PackMLState, reason: int, name: str) -> None:
    assert STATE_TEXTS[state_of(state, reason)] == name


def test_every_state_has_a_value_and_they_are_bits() -> None:
    found = {
        state_of(state, reason) for state in PackMLState for reason in (NONE, STARVED, BLOCKED, FAULT, FIRST_PLANNED)
    }
    assert found == set(STATE_TEXTS) and all(value.bit_count() == 1 for value in found)


@pytest.mark.parametrize("mode", [AUTOMATIC, MANUAL])
@pytest.mark.parametrize(
    ("state", "value"),
    [(PackMLState.STARTING, 2), (PackMLState.COMPLETING, 4), (PackMLState.COMPLETE, 0), (PackMLState.HELD, 1)],
)
def test_programs(mode: int, state: PackMLState, value: int) -> None:
    assert program(mode, state, NONE) == value
    assert program(MAINTENANCE, state, NONE) == 32


def test_the_tag_table_names_them_and_the_page_has_every_state() -> None:
    rows = tag_rows(load_scene("config/scenarios/two_stations.yaml"))
    named = {row.tag: row.weihenstephan for row in rows if row.weihenstephan != "-"}
    machines = {tag.rpartition("/")[0] for tag in named}
    assert machines == {row.device for row in rows if row.device_class in ("source", "sink", "station")}
    for machine in machines:
        own = {name for tag, names in named.items() if tag.startswith(f"{machine}/") for name in names.split(", ")}
        assert own >= DATA_POINTS.keys() - {"WS_Good_Containers"}
    sim = line(zones={"z": {"region": END}}, machines={"packer": sink()})
    assert not any(names_of(tag) for tag in sim.process_image.tags if tag.device != "machines/packer")
    shown = dict(re.findall(r"^\| (\d+) \| ([A-Z][a-z ]+) \|", PAGE, re.MULTILINE))
    assert shown == {str(value): text for value, text in STATE_TEXTS.items()}
